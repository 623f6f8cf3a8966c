"""A step of the navigation watch's learnt predictor: ours by numpy, and by ONNX Runtime where it is installed.

Why the gateway steps by numpy alone: ONNX Runtime gains nothing at one step a second, takes 68 MB on disk, and has no
wheels for 32-bit ARM. To see for yourself: pip install onnx onnxruntime, then gateway bench timing.
"""

from __future__ import annotations

from importlib.util import find_spec
from typing import Any

import numpy as np
from numpy.typing import NDArray

from detectors.navigation.lstm import FARTHEST, INPUTS, LEAK, OUTPUTS, Model, Predictor, read_model
from hil_tests.bench.timing import Comparison

FloatArray = NDArray[np.float64]

STEPS = 500
OPERATORS = 17  # version of ONNX's own
FILE_FORMAT = 8  # of ONNX; any runtime that knows those operators reads it


def has_onnx() -> bool:
    """ONNX Runtime and the package that builds its graphs are installed."""
    return all(find_spec(name) is not None for name in ("onnx", "onnxruntime"))


def predictor_step() -> Comparison:
    """The shipped model, step by step; without ONNX Runtime, see `has_onnx`, it cannot be built."""
    model = read_model()
    rows = np.random.default_rng(0).normal(size=(STEPS, INPUTS)) * model.input_scale + model.input_mean
    session = _session(model)
    return Comparison(
        work=f"predictor's step, {model.hidden} hidden units",
        peer="ONNX Runtime",
        unit="step",
        count=STEPS,
        ours=lambda: _ours(model, rows),
        theirs=lambda: _theirs(session, model.hidden, rows),
        agree=lambda ours, theirs: np.allclose(ours, theirs, rtol=1e-4, atol=1e-5),
    )


def _ours(model: Model, rows: FloatArray) -> FloatArray:
    predictor = Predictor(model)
    return np.array([np.concatenate(predictor.step(row)) for row in rows])


def _theirs(session: Any, hidden: int, rows: FloatArray) -> FloatArray:
    memory = [np.zeros((1, 1, hidden), dtype=np.float32)] * 2
    said = []
    for row in rows.astype(np.float32):
        inputs = {"features": row.reshape(1, 1, INPUTS), "hidden": memory[0], "cell": memory[1]}
        outputs, *memory = session.run(None, inputs)
        said.append(outputs[0])
    both = np.array(said, dtype=float)
    return np.hstack((both[:, :OUTPUTS], np.exp(both[:, OUTPUTS:])))


def _session(model: Model) -> Any:
    import onnxruntime

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1  # as numpy here
    return onnxruntime.InferenceSession(_graph(model), options, providers=["CPUExecutionProvider"])


def _graph(model: Model) -> bytes:
    """The model as a file of ONNX; its gates are in another order there, and have two biases."""
    from onnx import TensorProto, helper, numpy_helper

    hidden, gates = model.hidden, _reordered(model.gate_weights)
    bias = np.concatenate((_reordered(model.gate_bias), np.zeros(4 * model.hidden, dtype=np.float32)))
    constants = {
        "mean": model.input_mean,
        "scale": model.input_scale,
        "least": np.float32(-FARTHEST),
        "most": np.float32(FARTHEST),
        "for_inputs": gates[np.newaxis, :, :INPUTS],
        "for_hidden": gates[np.newaxis, :, INPUTS:],
        "bias": bias[np.newaxis],
        "no_lengths": np.ones(1, dtype=np.int32),
        "row": np.array([1, hidden]),
        "dense": model.dense_weights,
        "dense_bias": model.dense_bias,
        "output": model.output_weights,
        "output_bias": model.output_bias,
        "output_scale": model.output_scale,
        "output_mean": model.output_mean,
    }
    lstm = ["x", "for_inputs", "for_hidden", "bias", "no_lengths", "hidden", "cell"]
    nodes = [
        helper.make_node("Sub", ["features", "mean"], ["centred"]),
        helper.make_node("Div", ["centred", "scale"], ["scaled"]),
        helper.make_node("Clip", ["scaled", "least", "most"], ["x"]),
        helper.make_node("LSTM", lstm, ["", "next_hidden", "next_cell"], hidden_size=hidden),
        helper.make_node("Reshape", ["next_hidden", "row"], ["h"]),
        helper.make_node("Gemm", ["h", "dense", "dense_bias"], ["d"], transB=1),
        helper.make_node("LeakyRelu", ["d"], ["leaky"], alpha=LEAK),
        helper.make_node("Gemm", ["leaky", "output", "output_bias"], ["o"], transB=1),
        helper.make_node("Mul", ["o", "output_scale"], ["sized"]),
        helper.make_node("Add", ["sized", "output_mean"], ["outputs"]),
    ]
    shapes = {"features": [1, 1, INPUTS], "hidden": [1, 1, hidden], "cell": [1, 1, hidden]}
    results = {"outputs": [1, 2 * OUTPUTS], "next_hidden": [1, 1, hidden], "next_cell": [1, 1, hidden]}
    graph = helper.make_graph(
        nodes,
        "predictor",
        [helper.make_tensor_value_info(name, TensorProto.FLOAT, shape) for name, shape in shapes.items()],
        [helper.make_tensor_value_info(name, TensorProto.FLOAT, shape) for name, shape in results.items()],
        [numpy_helper.from_array(np.asarray(values), name) for name, values in constants.items()],
    )
    operators = [helper.make_opsetid("", OPERATORS)]
    made = helper.make_model(graph, opset_imports=operators, ir_version=FILE_FORMAT)
    return bytes(made.SerializeToString())


def _reordered(gates: NDArray[np.float32]) -> NDArray[np.float32]:
    """Input, output, forget, cell instead of input, forget, cell, output."""
    let_in, keep, candidate, let_out = np.split(gates, 4)
    return np.concatenate((let_in, let_out, keep, candidate))
