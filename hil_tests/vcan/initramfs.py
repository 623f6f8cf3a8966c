"""The machine's first file system: busybox, the kernel's modules and one script, as a cpio archive.

The format is "newc", as the kernel's own page describes it (Documentation/driver-api/early-userspace/buffer-format).
"""

from __future__ import annotations

import stat
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from hil_tests.vcan.interface import INTERFACE

# 9p: the host's root, cached: nothing in there is waited for that the host writes meanwhile; what the command writes
# goes into memory above it.
# The exchange directory has the same path inside as outside, and no cache: the host reads along.
INIT = f"""#!/bin/busybox sh
/bin/busybox --install -s /bin
export PATH=/bin
mount -t proc proc /proc
mount -t sysfs sys /sys
mount -t devtmpfs dev /dev
exchange=$(sed 's/.*exchange=\\([^ ]*\\).*/\\1/' /proc/cmdline)

while read -r module; do insmod "/modules/$module" || echo "init: $module not loaded"; done </modules/order

mount -t 9p -o trans=virtio,version=9p2000.L,ro,cache=loose,msize=512000 host /host
mount -t tmpfs -o size=80% memory /memory
mkdir /memory/upper /memory/work
mount -t overlay -o lowerdir=/host,upperdir=/memory/upper,workdir=/memory/work root /root
mount -t proc proc /root/proc
mount -t sysfs sys /root/sys
mount --bind /dev /root/dev
mkdir -p /root/dev/shm /root/dev/pts "/root$exchange"
mount -t tmpfs shm /root/dev/shm
mount -t devpts pts /root/dev/pts
mount -t 9p -o trans=virtio,version=9p2000.L,msize=512000 exchange "/root$exchange"

ip link set lo up
ip link add {INTERFACE} type vcan && ip link set {INTERFACE} up || echo "init: no {INTERFACE}"

chroot /root /bin/sh "$exchange/command" </dev/ttyS1 >/dev/ttyS1 2>&1
echo $? >"/root$exchange/exit_status"
poweroff -f
"""
_DIRECTORIES = ("bin", "dev", "proc", "sys", "host", "memory", "root", "modules")


@dataclass(frozen=True, slots=True)
class Entry:
    """One file or directory of a cpio archive; the mode holds type and permissions as stat(2) does."""

    name: str
    mode: int
    data: bytes = b""


def initramfs(busybox: Path, modules: Iterable[Path]) -> bytes:
    """The archive that the kernel unpacks and boots into; busybox must be statically linked."""
    modules = tuple(modules)
    order = "".join(f"{module.name}\n" for module in modules)
    entries = [Entry(name, stat.S_IFDIR | 0o755) for name in _DIRECTORIES]
    entries += [Entry(f"modules/{module.name}", stat.S_IFREG | 0o644, module.read_bytes()) for module in modules]
    entries += [
        Entry("modules/order", stat.S_IFREG | 0o644, order.encode()),
        Entry("bin/busybox", stat.S_IFREG | 0o755, busybox.read_bytes()),
        Entry("init", stat.S_IFREG | 0o755, INIT.encode()),
    ]
    return cpio(entries)


def cpio(entries: Iterable[Entry]) -> bytes:
    """A cpio archive in the "newc" format, everything in it owned by root."""
    numbered = enumerate([*entries, Entry("TRAILER!!!", 0)], start=1)
    return b"".join(_member(inode, entry) for inode, entry in numbered)


def _member(inode: int, entry: Entry) -> bytes:
    name = entry.name.encode() + b"\0"
    owner, links, modified, device = (0, 0), 1, 0, (0, 0, 0, 0)
    fields = (inode, entry.mode, *owner, links, modified, len(entry.data), *device, len(name), 0)
    header = b"070701" + b"".join(b"%08X" % field for field in fields)
    return _padded(header + name) + _padded(entry.data)


def _padded(data: bytes) -> bytes:
    return data + b"\0" * (-len(data) % 4)
