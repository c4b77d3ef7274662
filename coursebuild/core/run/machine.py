"""The machine that something is measured on, as reports name it.

Entry point: `machine()`.
"""

from __future__ import annotations

import platform
import subprocess
from pathlib import Path

from coursebuild.core.model.results import Machine
from coursebuild.core.run.versions import engine_version, package_version, python_version

_INFO = Path("/proc/cpuinfo")
_NAMES = ("model name", "Model", "Hardware", "cpu model", "uarch")
"""How kernels for different processors call the name, the best one first."""


def machine() -> Machine:
    """Versions, system and processor.

    Raises:
        EffectError: MuJoCo is not installed.
    """
    return Machine(
        engine=engine_version(),
        python=python_version(),
        numpy=package_version("numpy"),
        system=f"{platform.system()} {platform.machine()}".strip(),
        cpu=cpu_name(),
    )


def cpu_name() -> str:
    """What the processor calls itself; empty where it does not say."""
    if platform.system() == "Darwin":
        return _printed("sysctl", "-n", "machdep.cpu.brand_string")
    try:
        text = _INFO.read_text("utf-8", "replace")
    except OSError:
        return _tidy(platform.processor())
    return named(text)


def named(text: str) -> str:
    """The name in a text such as that of `/proc/cpuinfo`; empty where there is none."""
    fields = [line.partition(":") for line in text.splitlines()]
    for name in _NAMES:
        for key, _, value in fields:
            if key.strip() == name and value.strip():
                return _tidy(value)
    return ""


def _tidy(text: str) -> str:
    return " ".join(text.split())[:100]


def _printed(*command: str) -> str:
    try:
        done = subprocess.run(command, capture_output=True, timeout=10, check=False)
    except (OSError, subprocess.SubprocessError):
        return ""
    return _tidy(done.stdout.decode("utf-8", "replace"))
