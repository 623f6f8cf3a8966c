"""Every parser of the gateway under bytes that nobody would send: `python -m hil_tests.fuzz --list`.

A target reads bytes as a parser does, and says by an exception that the parser has not done what it must: bad bytes
never raise, what is read in parts is what is read at once, nothing is kept beyond bounds. The tests run each target
shortly, over valid logs and streams with damage; `make fuzz` for long, guided by the coverage.
"""
