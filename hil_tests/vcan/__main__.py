"""`python -m hil_tests.vcan COMMAND...`: run any command in the virtual machine, on its vcan0."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from hil_tests.vcan.kernel import MachineUnavailableError, guest_kernel
from hil_tests.vcan.machine import Machine, MachineError

NOT_RUN = 125  # as of env(1) and timeout(1): the command could not be run


def main(command: list[str]) -> int:
    """Run the command inside, its terminal joined to ours; its exit status, or NOT_RUN."""
    if not command:
        print(__doc__, file=sys.stderr)
        return NOT_RUN
    try:
        kernel = guest_kernel()
        with (
            tempfile.TemporaryDirectory(prefix="vcan-") as exchange,
            Machine(kernel, command, Path(exchange), stdin=None) as machine,
        ):
            return machine.wait()
    except (MachineUnavailableError, MachineError) as error:
        print(f"vcan: {error}", file=sys.stderr)
        return NOT_RUN


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
