"""Frames as columns, there and back."""

from __future__ import annotations

import numpy as np
import pytest

from drivers.can.frame import CanFrame
from drivers.can.frame_block import FrameBlock

FRAMES = [
    CanFrame(1.0, 0x123, b"\x01\x02", extended=False),
    CanFrame(2.0, 0x1FFFFFFF, bytes(range(8))),
    CanFrame(3.0, 0x40, b"", extended=False, error=True),
]
FD_FRAME = CanFrame(4.0, 0x7, bytes(range(48)), extended=False, fd=True)


@pytest.mark.parametrize("frames", [[], FRAMES, [*FRAMES, FD_FRAME]])
def test_a_block_gives_back_its_frames(frames):
    assert list(FrameBlock.of(frames).frames()) == frames


def test_a_part_has_its_frames_only():
    block = FrameBlock.of([*FRAMES, FD_FRAME])
    assert list(block.part(slice(1, 3)).frames()) == FRAMES[1:]
    assert list(block.part(block.identifier == 7).frames()) == [FD_FRAME]


def test_columns_of_different_lengths_are_refused():
    block = FrameBlock.of(FRAMES)
    with pytest.raises(ValueError, match="columns must have one length"):
        FrameBlock(block.time_s[:1], block.identifier, block.kind, block.length, block.data)


def test_data_of_another_width_are_refused():
    block = FrameBlock.of(FRAMES)
    with pytest.raises(ValueError, match=r"data must be \(N, 8\) or \(N, 64\)"):
        FrameBlock(block.time_s, block.identifier, block.kind, block.length, np.zeros((3, 9), np.uint8))


@pytest.mark.parametrize("several", [[FRAMES], [FRAMES[:1], [], [FD_FRAME], FRAMES], [[FD_FRAME], [FD_FRAME]]])
def test_joined_blocks_have_the_frames_of_all(several):
    whole = FrameBlock.joined([FrameBlock.of(frames) for frames in several])
    assert list(whole.frames()) == [frame for frames in several for frame in frames]
