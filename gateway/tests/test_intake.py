"""What comes in is written down in the order in which it is judged, and each piece of work knows its place there."""

from drivers.can.frame import CanFrame
from drivers.can.frame_block import FrameBlock
from drivers.readings import LinkState, ThrusterCommand
from gateway.intake import Intake
from gateway.recording.journal import NoJournal


class Written(NoJournal):
    """A journal that counts as it should, and keeps what it was told."""

    def __init__(self):
        self.count, self.lines = 0, []

    @property
    def place(self):
        return self.count

    def frames(self, bus, frames):
        self.count += len(frames)
        self.lines.append(("frames", bus, len(frames)))

    def heard(self, data, time_s):
        self.count += 1
        self.lines.append(("heard", data))

    def said(self, data, time_s):
        self.count += 1
        self.lines.append(("said", data))

    def reading(self, link, reading, before=None):
        self.count += 1
        self.lines.append(("reading", link, reading))

    def decoded(self, link, readings):
        self.lines.append(("decoded", link, tuple(readings)))


def block(count):
    return FrameBlock.of([CanFrame(1.0 + n, n, b"") for n in range(count)])


COMMAND, STATE = ThrusterCommand(1.0, 1, 0.5), LinkState(1.0, "can0", True, "")


def test_work_is_put_with_the_place_of_the_first_frame_that_it_is_of():
    journal, put = Written(), []
    intake = Intake(lambda work: put.append((intake.first, work.link, *work.readings)) or True, journal)
    intake.frames("can0", block(3))
    intake.decoded("can0", [COMMAND])
    intake.frames("can0", block(2))
    intake.decoded("can0", [])
    assert intake.reading("can0", STATE)
    intake.heard(b"abc", 2.0)
    intake.said(b"answer", 2.0)
    intake.decoded("mavlink", [COMMAND])
    assert put == [(1, "can0", COMMAND), (6, "can0", STATE), (7, "mavlink", COMMAND)]
    kinds = [line[0] for line in journal.lines]
    assert kinds == ["frames", "decoded", "frames", "reading", "heard", "said", "decoded"]


def test_after_its_end_nothing_is_judged_or_written_down_but_what_goes_out():
    journal, put = Written(), []
    intake = Intake(lambda work: put.append(work) or True, journal)
    intake.close()
    intake.frames("can0", block(1))
    intake.heard(b"abc", 2.0)
    intake.decoded("can0", [COMMAND])
    assert not intake.reading("can0", STATE)
    intake.said(b"bye", 2.0)
    assert (put, journal.lines) == ([], [("said", b"bye")])
