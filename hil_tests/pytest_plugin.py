"""For tests of your own: play scenarios from Python, against the real gateway.

Loaded by pytest itself wherever this package is installed. `hil_tests/examples/test_my_vehicle.py` shows its use.

    gateway_rig    plays a scenario, from a file or built in Python, and returns what came of it
    scenario       the scenario that `@pytest.mark.scenario(name, **changes)` names, ready for the rig

`pytest --hil-can vcan0` plays them in real time on a bus of the kernel, `--hil-realtime` in real time in memory.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from hil_tests.playback.way import Way
    from hil_tests.report.outcome import Outcome
    from hil_tests.scenario.document import Scenario

MARKER = "scenario(name, **changes): the scenario, by its file or the name of one that ships, that the test plays"


def pytest_addoption(parser: pytest.Parser) -> None:
    """See the module's text."""
    group = parser.getgroup("thruster gateway")
    group.addoption("--hil-can", metavar="CHANNEL", help="play scenarios in real time on this virtual SocketCAN bus")
    group.addoption("--hil-realtime", action="store_true", help="play scenarios in real time, in memory")


def pytest_configure(config: pytest.Config) -> None:
    """Makes the marker known."""
    config.addinivalue_line("markers", MARKER)


class GatewayRig:
    """A simulated vehicle and the real gateway.

    Args:
        folder: where plays are recorded, each in a folder of its own.
        home: what paths of scenarios are relative to.
        way: how they are played.
    """

    def __init__(self, folder: Path, home: Path, way: Way) -> None:
        self._folder, self._home, self._way, self._plays = folder, home, way, 0

    def load(self, named: str | Path, **changes: Any) -> Scenario:
        """A scenario, by its file or the name of one that ships, with some of its fields set anew.

        Raises:
            ConfigError: it has problems.
            ValueError: there is none of this name.
        """
        from hil_tests.scenario.document import Scenario
        from hil_tests.scenario.loading import load_scenario
        from hil_tests.scenario.shelf import scenario_files

        file = self._home / named
        [path] = [file] if file.is_file() else scenario_files([str(named)])
        loaded = load_scenario(path)
        fields = {name: getattr(loaded, name) for name in Scenario.model_fields}
        return Scenario(**fields | changes)

    def play(self, scenario: Scenario | str | Path | None = None, **fields: Any) -> Outcome:
        """Plays a scenario to its end.

        Args:
            scenario: one that was loaded, or its file or name; None: `fields` are the scenario.
            fields: of the scenario, as in its file; of one that is named, those that are set anew.

        Raises:
            ConfigError, ValueError: it cannot be played.
        """
        from drivers.can.port import CanPortError
        from hil_tests.bridge.permission import RefusedError
        from hil_tests.playback.play import play
        from hil_tests.scenario.document import Scenario

        if scenario is None:
            scenario = Scenario(**fields)
        elif not isinstance(scenario, Scenario):
            scenario = self.load(scenario, **fields)
        self._plays += 1
        folder = self._folder / f"play{self._plays}"
        try:
            return play(scenario, self._home / "scenario.yaml", folder, self._way)
        except (CanPortError, RefusedError) as error:  # no fault of the test: how pytest was called
            pytest.fail(f"--hil-can {self._way.channel}: {error}", pytrace=False)

    def require(self, outcome: Outcome) -> None:
        """All that the scenario expects has come about, and nothing that it forbids.

        Raises:
            AssertionError: in words, what did not.
        """
        from hil_tests.report.expectations import checks

        missed = [f"{check.expected}: {check.seen}" for check in checks(outcome) if not check.passed]
        assert not missed, "\n".join([outcome.scenario.name or "scenario", *missed])  # noqa: S101


@pytest.fixture
def gateway_rig(request: pytest.FixtureRequest, tmp_path: Path) -> GatewayRig:
    """Plays scenarios; see `GatewayRig`."""
    from hil_tests.playback.way import Way

    option = request.config.getoption
    return GatewayRig(
        tmp_path, request.path.parent, Way(realtime=bool(option("--hil-realtime")), channel=option("--hil-can"))
    )


@pytest.fixture
def scenario(request: pytest.FixtureRequest, gateway_rig: GatewayRig) -> Scenario:
    """The scenario that the test's marker names."""
    marker = request.node.get_closest_marker("scenario")
    if marker is None or len(marker.args) != 1:
        pytest.fail(f"the fixture `scenario` wants @pytest.mark.{MARKER}", pytrace=False)
    try:
        return gateway_rig.load(*marker.args, **marker.kwargs)
    except ValueError as error:  # problems of a file are such as well
        pytest.fail(str(error), pytrace=False)
