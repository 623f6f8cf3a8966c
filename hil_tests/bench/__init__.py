"""`gateway bench`: our detectors beside their peers and their papers' figures, and our code's time beside theirs."""

from hil_tests.bench.command import bench

__all__ = ["bench"]
