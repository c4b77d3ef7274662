"""The machine of a measurement, and its single processor."""

from __future__ import annotations

import contextlib
import hashlib
import importlib.metadata
import os
import platform
import subprocess
from collections.abc import Iterator
from pathlib import Path

from msgspec import Struct

_CAN_PIN = hasattr(os, "sched_setaffinity")
_GOVERNOR = Path("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor")
_INFO = Path("/proc/cpuinfo")


class Machine(Struct, frozen=True, forbid_unknown_fields=True):
    """The machine of a measurement; times mean nothing without it."""

    engine: str
    """Version of MuJoCo."""
    python: str
    numpy: str
    system: str
    """Operating system and kind of processor, such as `Linux x86_64`."""
    cpu: str
    """The processor's own name; empty where it has none."""
    governor: str = ""
    """The rule by which the system sets the processor's clock; empty where not known."""
    processors: int = 0
    """The number of usable processors; 0 where that was not recorded."""
    pinned: bool = False
    """Whether times were taken on a single one of them."""

    @property
    def text(self) -> str:
        """The same in words, but for the number of processors."""
        versions = f"MuJoCo {self.engine}, Python {self.python}, NumPy {self.numpy}"
        clock = f"clock governor {self.governor}" if self.governor else ""
        return ", ".join(filter(None, (versions, self.system, self.cpu, clock)))


def this_machine(*, pinned: bool = False) -> Machine:
    """Versions, system and processor; `pinned`: times are taken on one processor alone."""
    return Machine(
        engine=package_version("mujoco"),
        python=platform.python_version(),
        numpy=package_version("numpy"),
        system=f"{platform.system()} {platform.machine()}".strip(),
        cpu=_cpu_name(),
        governor=_read(_GOVERNOR).strip(),
        processors=len(os.sched_getaffinity(0)) if _CAN_PIN else os.cpu_count() or 0,
        pinned=pinned and _CAN_PIN,
    )


def package_version(name: str) -> str:
    """The version of an installed package; empty where it has none."""
    try:
        return importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        return ""


def code_digest() -> str:
    """A hash of this package's code: other code may measure other figures."""
    digest = hashlib.sha256()
    for file in sorted(Path(__file__).parent.rglob("*.py")):
        digest.update(file.read_bytes())
    return digest.hexdigest()


@contextlib.contextmanager
def one_processor() -> Iterator[None]:
    """Keep this thread on one of the processors that it may use, where the system can do that."""
    if not _CAN_PIN:
        yield
        return
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {max(before)})
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)


def _cpu_name() -> str:
    if platform.system() == "Darwin":
        command = ["/usr/sbin/sysctl", "-n", "machdep.cpu.brand_string"]
        with contextlib.suppress(OSError, subprocess.SubprocessError):
            done = subprocess.run(command, capture_output=True, text=True, timeout=10, check=True)
            return " ".join(done.stdout.split())
        return ""
    pairs = (line.partition(":") for line in _read(_INFO).splitlines())
    fields = {key.strip().lower(): " ".join(value.split()) for key, _, value in pairs}
    names = (fields.get(key, "") for key in ("model name", "hardware", "cpu model"))
    return next(filter(None, names), "") or platform.machine()


def _read(file: Path) -> str:
    try:
        return file.read_text(encoding="utf-8", errors="replace")
    except OSError:
        return ""
