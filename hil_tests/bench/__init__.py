"""`gateway bench`: the thruster detector beside its peers on random runs, and our code's speed beside theirs."""

from hil_tests.bench.command import bench

__all__ = ["bench"]
