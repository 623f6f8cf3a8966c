"""`python -m hil_tests.fuzz`, also as `make fuzz`."""

from hil_tests.fuzz.command import fuzz

fuzz(prog_name="python -m hil_tests.fuzz")
