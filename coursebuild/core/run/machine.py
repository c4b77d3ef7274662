"""The machine that something is measured on, as reports name it.

Entry points: `machine()`; `one_processor()`, while something is timed.
"""

from __future__ import annotations

import os
import platform
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from coursebuild.core.model.results import Machine
from coursebuild.core.run.script_environment import Interpreter
from coursebuild.core.run.versions import engine_version, package_version, python_version

_INFO = Path("/proc/cpuinfo")
_GOVERNOR = Path("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor")
_NAMES = ("model name", "Model", "Hardware", "cpu model", "uarch")
"""The keys of the name in kernels for different processors, the best one first."""
_CAN_PIN = hasattr(os, "sched_setaffinity")


def machine(*, pinned: bool = False, interpreter: Interpreter | None = None) -> Machine:
    """Versions, system and processor; `pinned`: times are taken on one processor alone.

    `interpreter` is another one than runs the tool.

    Raises:
        EffectError: MuJoCo is not installed.
    """
    return Machine(
        engine=engine_version() if interpreter is None else interpreter.engine,
        python=python_version() if interpreter is None else interpreter.version,
        numpy=package_version("numpy", None if interpreter is None else interpreter.packages),
        system=f"{platform.system()} {platform.machine()}".strip(),
        cpu=cpu_name(),
        governor=_read(_GOVERNOR).strip(),
        processors=len(os.sched_getaffinity(0)) if _CAN_PIN else os.cpu_count() or 0,
        pinned=pinned and _CAN_PIN,
    )


@contextmanager
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


def cpu_name() -> str:
    """What the processor calls itself; empty where it does not say."""
    if platform.system() == "Darwin":
        return _run("sysctl", "-n", "machdep.cpu.brand_string")
    return find_cpu_name(_read(_INFO)) or _tidy(platform.processor())


def find_cpu_name(text: str) -> str:
    """The name in a text such as that of `/proc/cpuinfo`; empty where there is none."""
    fields = [line.partition(":") for line in text.splitlines()]
    for name in _NAMES:
        for key, _, value in fields:
            if key.strip() == name and value.strip():
                return _tidy(value)
    return ""


def _read(path: Path) -> str:
    try:
        return path.read_text("utf-8", "replace")
    except OSError:
        return ""


def _tidy(text: str) -> str:
    return " ".join(text.split())[:100]


def _run(*command: str) -> str:
    try:
        process = subprocess.run(command, capture_output=True, timeout=10, check=False)
    except (OSError, subprocess.SubprocessError):
        return ""
    return _tidy(process.stdout.decode("utf-8", "replace"))
