"""The kernel of the virtual machine: Debian's own, taken out of its package without installing it."""

from __future__ import annotations

import lzma
import os
import platform
import re
import shutil
import subprocess
import tarfile
import tempfile
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import IO

QEMU = "qemu-system-x86_64"
META_PACKAGE = "linux-image-amd64"
OWN_VCAN = "or, as root: modprobe vcan; ip link add vcan0 type vcan; ip link set vcan0 up"

# In the order of their dependencies. One that a kernel has built in, or has merged into another, is not in its
# package and is left out; that vcan0 exists in the end is what proves the list complete.
MODULES = (
    *("virtio_ring", "virtio", "virtio_pci_modern_dev", "virtio_pci_legacy_dev", "virtio_pci"),
    *("netfs", "fscache", "9pnet", "9pnet_virtio", "9p", "overlay"),
    *("can", "can-raw", "can-bcm", "can-isotp", "can-gw", "can-dev", "vcan"),
)


class MachineUnavailableError(Exception):
    """The virtual machine cannot be had here; the text says why, and what to install."""


@dataclass(frozen=True, slots=True)
class GuestKernel:
    """A bootable kernel image and the modules to load, in their order."""

    image: Path
    modules: tuple[Path, ...]


def guest_kernel(cache: Path | None = None) -> GuestKernel:
    """The kernel to boot: out of the cache, or else downloaded with apt-get (no root needed, about 70 MB).

    Raises:
        MachineUnavailableError: no emulator, no busybox or no kernel here, with what to install.
    """
    _require_tools()
    cache = cache or _default_cache()
    for unpacked in sorted(cache.glob("linux-image-*"), reverse=True):
        return _kernel_in(unpacked)
    cache.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=cache, prefix="download-") as directory:
        package = _download(Path(directory))
        unpacked = Path(directory) / package.stem
        _unpack(package, unpacked)
        kernel = _kernel_in(unpacked)  # complete, before others can see it
        target = cache / unpacked.name
        unpacked.rename(target)
    return GuestKernel(target / kernel.image.name, tuple(target / module.name for module in kernel.modules))


def _require_tools() -> None:
    if platform.machine() != "x86_64":
        raise MachineUnavailableError(f"the machine is for x86_64, this is {platform.machine()}; {OWN_VCAN}")
    packages = {QEMU: "qemu-system-x86", "busybox": "busybox-static"}
    missing = [package for tool, package in packages.items() if shutil.which(tool) is None]
    if missing:
        raise MachineUnavailableError(f"as root: apt-get install {' '.join(missing)}; {OWN_VCAN}")


def _default_cache() -> Path:
    root = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(root, "thruster-gateway", "vcan")


def _download(directory: Path) -> Path:
    """Download the newest kernel package that the meta-package names into `directory`."""
    if shutil.which("apt-get") is None or shutil.which("dpkg-deb") is None:
        raise MachineUnavailableError(f"no apt-get here to download Debian's kernel with; {OWN_VCAN}")
    depends = _output("apt-cache", "depends", META_PACKAGE, cwd=directory)
    named = re.search(r"Depends: (linux-image-\d\S+)", depends)
    if named is None:
        raise MachineUnavailableError(f"apt knows no {META_PACKAGE}; as root: apt-get update")
    # APT::Sandbox::User: without it, root is warned that the directory is private to root
    _output("apt-get", "-o", "APT::Sandbox::User=root", "download", named[1], cwd=directory)
    return next(directory.glob("linux-image-*.deb"))


def _output(*command: str, cwd: Path) -> str:
    environment = os.environ | {"LC_ALL": "C"}
    done = subprocess.run(command, cwd=cwd, env=environment, capture_output=True, text=True, timeout=600, check=False)
    if done.returncode:
        last = (done.stderr.strip() or "no message").splitlines()[-1]
        raise MachineUnavailableError(f"`{' '.join(command)}` failed: {last}; as root: apt-get update")
    return done.stdout


def _unpack(package: Path, target: Path) -> None:
    """Take the kernel image and the modules that we load out of a Debian kernel package."""
    target.mkdir()
    with (
        subprocess.Popen(("dpkg-deb", "--fsys-tarfile", package), stdout=subprocess.PIPE) as archive,
        tarfile.open(fileobj=archive.stdout, mode="r|") as members,
    ):
        for member in members:
            content = members.extractfile(member) if _wanted(member.name) else None
            if content is not None:
                _store(content, PurePosixPath(member.name).name, target)


def _wanted(name: str) -> bool:
    path = PurePosixPath(name)
    return path.name.startswith("vmlinuz-") or path.name.partition(".ko")[0] in MODULES


def _store(content: IO[bytes], name: str, target: Path) -> None:
    data = content.read()
    if name.endswith(".xz"):
        name, data = name.removesuffix(".xz"), lzma.decompress(data)
    (target / name).write_bytes(data)


def _kernel_in(unpacked: Path) -> GuestKernel:
    modules = tuple(path for name in MODULES if (path := unpacked / f"{name}.ko").is_file())
    images = list(unpacked.glob("vmlinuz-*"))
    if len(images) != 1 or not any(module.stem == "vcan" for module in modules):
        raise MachineUnavailableError(f"{unpacked} holds no kernel with a vcan module; remove it, then once more")
    return GuestKernel(images[0], modules)
