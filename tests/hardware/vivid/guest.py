"""A small virtual machine around the host's own files: Debian's kernel, no disk, no network.

The guest sees the host's root read-only over 9p, so that it runs the virtual environment that the
tests run in, and one writable share for results. Its kernel is started as an uncompressed ELF image
(PVH). Plain emulation is enough; KVM is not asked for. A busy host does not disturb its timing.
"""

import contextlib
import lzma
import re
import shutil
import subprocess
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

RESULTS = "/run/results"
"""Where the guest writes what the host shall find."""
_SHARES = ("virtio_pci", "9pnet_virtio", "9p")
"""What the guest needs to see the host's files."""
_XZ_MAGIC = b"\xfd7zXZ\x00"
_ELF_MAGIC = b"\x7fELF"


class GuestUnavailableError(Exception):
    """The machine cannot be built here; the message says what is missing."""


@dataclass(frozen=True)
class GuestKernel:
    """The files that QEMU boots."""

    image: Path
    modules: Path
    """Folder with all modules that the guest loads, `*.ko`."""


def guest_kernel(folder: Path, modules: Iterable[str]) -> GuestKernel:
    """Return Debian's stock kernel, fetched with apt-get and unpacked once.

    Args:
        folder: kept from run to run; 80 MB.
        modules: kernel modules that will be asked for.

    Raises:
        GuestUnavailableError: not a Debian machine, or its packages cannot be reached.
    """
    package = _kernel_package()
    home = folder / package
    kernel = GuestKernel(home / "vmlinux", home / "modules")
    if home.is_dir():
        return kernel
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder) as work:
        unpacked, fresh = Path(work), Path(work) / "fresh"
        (fresh / "modules").mkdir(parents=True)
        _run(["apt-get", "-o", "APT::Sandbox::User=root", "download", "-qq", package], unpacked)
        _run(["dpkg-deb", "-x", next(unpacked.glob("*.deb")).name, "."], unpacked)
        compressed = next((unpacked / "boot").glob("vmlinuz-*")).read_bytes()
        (fresh / "vmlinux").write_bytes(uncompressed(compressed))
        for path in in_order(unpacked / "lib" / "modules", (*_SHARES, *modules)):
            path.rename(fresh / "modules" / path.name)
        with contextlib.suppress(OSError):  # another run was faster
            fresh.rename(home)
    return kernel


def uncompressed(image: bytes) -> bytes:
    """Return the ELF image inside a compressed kernel (bzImage).

    Raises:
        GuestUnavailableError: there is none, or it is compressed in another way than xz.
    """
    for found in re.finditer(re.escape(_XZ_MAGIC), image):
        try:
            content = lzma.LZMADecompressor().decompress(image[found.start() :])
        except lzma.LZMAError:
            continue  # the same bytes by chance
        if content.startswith(_ELF_MAGIC):
            return content
    raise GuestUnavailableError("the kernel holds no xz-compressed ELF image")


def in_order(modules: Path, wanted: Iterable[str]) -> list[Path]:
    """Return modules and all that they depend on, in the order of loading.

    Source: the `depends=` entry that every module carries in its `.modinfo` section.
    """
    files = {path.stem.replace("-", "_"): path for path in modules.rglob("*.ko")}
    ordered: dict[str, Path] = {}

    def add(name: str) -> None:
        if name in ordered or name not in files:  # else: built into the kernel
            return
        content = files[name].read_bytes()
        start = content.index(b"depends=") + len(b"depends=")
        depends = content[start : content.index(b"\0", start)].decode()
        for needed in filter(None, depends.split(",")):
            add(needed.replace("-", "_"))
        ordered[name] = files[name]

    for name in wanted:
        add(name)
    return list(ordered.values())


def cpio(files: dict[str, bytes], folders: Iterable[str]) -> bytes:
    """Return a cpio archive ("newc") as the kernel reads its first files from.

    Source: the kernel's documentation, "initramfs buffer format".
    """
    entries = [*((name, 0o040755, b"") for name in folders)]
    entries += [(name, 0o100755, content) for name, content in files.items()]
    entries.append(("TRAILER!!!", 0, b""))
    return b"".join(_entries(entries))


def boot(
    kernel: GuestKernel,
    *,
    script: str,
    modules: Mapping[str, str],
    results: Path,
    memory_mb: int,
    timeout_s: float,
) -> str:
    """Boot the guest, run a shell script as root in the host's files, and switch it off.

    Args:
        kernel: what to boot.
        script: runs with the host's root as its own, read-only but for `/run`.
        modules: kernel modules to load before, with their parameters.
        results: folder of the host that the guest may write to, as `RESULTS`.
        memory_mb: the guest's memory.
        timeout_s: longest life of the guest.

    Returns:
        what the guest wrote to its console, and then what the script wrote.

    Raises:
        GuestUnavailableError: QEMU or busybox is not installed.
        subprocess.TimeoutExpired: the guest did not switch itself off in time; it is gone.
    """
    qemu = _installed("qemu-system-x86_64", "qemu-system-x86")
    busybox = Path(_installed("busybox", "busybox-static"))
    ordered = in_order(kernel.modules, (*_SHARES, *modules))
    load = "".join(
        f"insmod /modules/{path.name} {modules.get(path.stem, '')}\n" for path in ordered
    )
    files = {
        "init": _INIT.format(load=load, results=RESULTS).encode(),
        "bin/busybox": busybox.read_bytes(),
    }
    files |= {f"modules/{path.name}": path.read_bytes() for path in ordered}
    initramfs = results / "initramfs"
    initramfs.write_bytes(cpio(files, ("bin", "modules", "dev", "proc", "sys", "host")))
    (results / "script").write_text(script)
    command = [
        qemu, "-M", "q35", "-cpu", "max", "-smp", "1",
        # The guest's clock counts its instructions, 2 ns each, and follows the host's only while
        # it idles: however busy the host is, the guest sees the same quick machine.
        "-accel", "tcg", "-icount", "shift=1,sleep=on",
        "-m", str(memory_mb), "-nographic", "-no-reboot", "-nodefaults", "-serial", "stdio",
        "-kernel", str(kernel.image), "-initrd", str(initramfs),
        "-append", "console=ttyS0 quiet panic=-1",
        "-virtfs", "local,path=/,mount_tag=host,security_model=none,readonly=on,multidevs=remap",
        "-virtfs", f"local,path={results},mount_tag=results,security_model=none",
    ]  # fmt: skip
    ended = subprocess.run(
        command,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        timeout=timeout_s,
        check=False,
    )
    log = results / "log"
    said = log.read_text(errors="replace") if log.is_file() else "(the script did not start)"
    return ended.stdout.decode(errors="replace") + said


_INIT = """#!/bin/busybox sh
/bin/busybox --install -s /bin
mount -t devtmpfs dev /dev; mount -t proc proc /proc; mount -t sysfs sys /sys
{load}
opt=trans=virtio,version=9p2000.L,msize=1048576
mount -t 9p -o $opt,ro,cache=loose host /host
mount -t devtmpfs dev /host/dev; mount -t proc proc /host/proc; mount -t sysfs sys /host/sys
mkdir -p /host/dev/shm /host/dev/pts
mount -t devpts pts /host/dev/pts
for place in run dev/shm; do mount -t tmpfs tmpfs /host/$place; done
mkdir -p /host{results} /host/run/tmp
mount -t 9p -o $opt results /host{results}
ip link set lo up
export HOME=/run/tmp TMPDIR=/run/tmp
export PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin
chroot /host /bin/sh {results}/script >/host{results}/log 2>&1
sync; poweroff -f
"""


def _entries(entries: list[tuple[str, int, bytes]]) -> Iterator[bytes]:
    for number, (name, mode, content) in enumerate(entries, start=1):
        raw = name.encode() + b"\0"
        fields = (number, mode, 0, 0, 1, 0, len(content), 0, 0, 0, 0, len(raw), 0)
        header = b"070701" + b"".join(b"%08x" % field for field in fields) + raw
        yield header + bytes(-len(header) % 4) + content + bytes(-len(content) % 4)


def _kernel_package() -> str:
    for tool in ("apt-get", "apt-cache", "dpkg-deb"):
        _installed(tool, "a Debian system")
    shown = subprocess.run(
        ["apt-cache", "depends", "linux-image-amd64"], capture_output=True, text=True, check=False
    ).stdout
    found = re.search(r"Depends: (linux-image-\S+)", shown)
    if found is None:
        raise GuestUnavailableError("linux-image-amd64 is in no package list; run `apt-get update`")
    return found[1]


def _installed(tool: str, package: str) -> str:
    found = shutil.which(tool)
    if found is None:
        raise GuestUnavailableError(f"{tool} is not there; it comes with {package}")
    return found


def _run(command: list[str], folder: Path) -> None:
    try:
        subprocess.run(command, cwd=folder, check=True, capture_output=True, text=True)
    except subprocess.CalledProcessError as error:
        raise GuestUnavailableError(
            f"{' '.join(command)}: {error.stderr.strip()[-300:]}"
        ) from error
