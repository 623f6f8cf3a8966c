"""Tests marked `vcan` run on this machine's own vcan0 where it has one, else in the machine of hil_tests.vcan.

In that machine, one more pytest runs all of them while the others run here; after these, each is reported under its
own name, as if it had run here.
Where there is neither, they are skipped, and the summary says so. VCAN_REQUIRED=1 makes that a failure.
"""

import gc
import os
from contextlib import ExitStack

import pytest
from hypothesis import settings

# small matrices: on a busy machine BLAS's threads wait for each other more than they work; set before numpy comes in
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from hil_tests.vcan.guest_tests import REPORT_OPTION, GuestTests, write_report
from hil_tests.vcan.interface import has_vcan
from hil_tests.vcan.kernel import MachineUnavailableError, guest_kernel
from hil_tests.vcan.machine import MachineError

# machines are shared: that an example takes long is no fault of the code
settings.register_profile("shared machine", deadline=None)
settings.load_profile("shared machine")


def pytest_addoption(parser):
    parser.addoption(REPORT_OPTION, metavar="FILE", help="write every report to FILE, for the pytest outside")


def pytest_configure(config):
    if config.getoption(REPORT_OPTION):
        config.pluginmanager.register(ReportWriter(config))
    elif not has_vcan():
        config.pluginmanager.register(MachineRunner(config))


def pytest_collection_finish():
    gc.freeze()  # what is imported by now stays: else each full collection goes through all of it


class ReportWriter:
    """Inside the machine: tells of every report."""

    def __init__(self, config):
        self._config = config
        self._file = open(config.getoption(REPORT_OPTION), "a")  # noqa: SIM115, PTH123 - closed in pytest_unconfigure

    def pytest_runtest_logreport(self, report):
        data = self._config.hook.pytest_report_to_serializable(config=self._config, report=report)
        write_report(data, self._file)

    def pytest_unconfigure(self):
        self._file.close()


class MachineRunner:
    """Outside: has the marked tests run inside, beside all others, and reports after these what is told of them."""

    def __init__(self, config):
        self._config = config
        self._resources = ExitStack()
        self._node_ids = []
        self._guest = None
        self._unavailable = None

    @pytest.hookimpl(trylast=True)  # after -k, -m and --deselect have chosen
    def pytest_collection_modifyitems(self, items):
        marked = [item for item in items if item.get_closest_marker("vcan")]
        for item in marked:
            item.add_marker(pytest.mark.timeout(0), append=False)  # the pytest inside keeps the time limit
        self._node_ids = [item.nodeid for item in marked]
        items[:] = [item for item in items if item not in marked] + marked

    def pytest_runtestloop(self, session):
        if self._node_ids and not session.config.option.collectonly:
            self._start()

    def pytest_runtest_protocol(self, item):
        if item.nodeid not in self._node_ids or self._guest is None:
            return None
        item.ihook.pytest_runtest_logstart(nodeid=item.nodeid, location=item.location)
        for report in self._reports(item):
            item.ihook.pytest_runtest_logreport(report=report)
        item.ihook.pytest_runtest_logfinish(nodeid=item.nodeid, location=item.location)
        return True

    def pytest_runtest_setup(self, item):
        if item.nodeid in self._node_ids:  # came here, so there is no machine
            missing = pytest.fail if os.environ.get("VCAN_REQUIRED") else pytest.skip
            missing(f"no vcan0 here, and no virtual machine with one: {self._unavailable}")

    def pytest_terminal_summary(self, terminalreporter):
        if self._unavailable:
            terminalreporter.section("BUS TESTS NOT RUN", red=True)
            terminalreporter.write_line(f"{len(self._node_ids)} tests need a real CAN bus: {self._unavailable}")

    def pytest_unconfigure(self):
        self._resources.close()

    def _start(self):
        try:
            guest = GuestTests(guest_kernel(), self._node_ids, self._config.rootpath)
            self._guest = self._resources.enter_context(guest)
        except MachineUnavailableError as reason:
            self._unavailable = reason

    def _reports(self, item):
        try:
            for data in self._guest.reports(item.nodeid):
                if isinstance(data["longrepr"], list):
                    data["longrepr"] = tuple(data["longrepr"])  # why it was skipped; JSON knows no tuples
                yield self._config.hook.pytest_report_from_serializable(config=self._config, data=data)
        except MachineError as error:
            yield pytest.TestReport(item.nodeid, item.location, {}, "failed", str(error), "call")
