"""The predictor beside ONNX Runtime, where that is installed: two codes, one network."""

import pytest

from hil_tests.bench.predictor_timing import has_onnx, predictor_step
from hil_tests.bench.works import WORKS


def test_onnx_runtime_says_the_same():
    if not has_onnx():
        pytest.skip("pip install onnx onnxruntime to compare the learnt predictor with them")
    comparison = predictor_step()
    assert comparison.agree(comparison.ours(), comparison.theirs())


def test_is_timed_where_there_is_something_to_compare_with():
    assert ("predictor" in WORKS) == has_onnx()
