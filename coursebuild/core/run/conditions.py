"""What a script's result depends on besides the script: interpreter, system, environment.

Entry points: `conditions`, `places`.
"""

from __future__ import annotations

import hashlib
import json
import os
import sys
from collections.abc import Mapping
from pathlib import Path

from coursebuild.core.run.surroundings import clean_environment

_SAYS_NOTHING = frozenset(
    {
        "PATH",
        "HOME",
        "USER",
        "LOGNAME",
        "VIRTUAL_ENV",
        "CONDA_PREFIX",
        "SYSTEMROOT",
        "SYSTEMDRIVE",
    }
)
"""Variables that say who runs a script and where programs lie, which its result does not show."""


def conditions(outer: Mapping[str, str]) -> tuple[tuple[str, str], ...]:
    """By name, sorted: what has to be the same for a result to be the same.

    `outer` is the environment of the tool.
    """
    environment = clean_environment(outer)
    fixed = clean_environment({})
    told = {
        f"environment variable {name}": value
        for name, value in environment.items()
        if name not in fixed and name not in _SAYS_NOTHING
    }
    import platform

    told["Python"] = f"{platform.python_implementation()} {platform.python_version()}"
    told["platform"] = f"{sys.platform} {platform.machine()} {_c_library()}".strip()
    same = json.dumps(fixed, sort_keys=True).encode()
    told["the fixed environment of scripts"] = hashlib.sha256(same).hexdigest()[:12]
    return tuple(sorted(told.items()))


def _c_library() -> str:
    """Whose mathematical functions Python's are."""
    try:
        return (os.confstr("CS_GNU_LIBC_VERSION") or "") if hasattr(os, "confstr") else ""
    except (OSError, ValueError):
        return ""


def places(
    root: Path, outer: Mapping[str, str], prefix: str | None = None
) -> tuple[tuple[str, str], ...]:
    """Folders of this machine whose paths may stand in what a script writes, longest first.

    `prefix` is that of another interpreter than the one that runs this.
    """
    found = {
        "course": str(root),
        "library": str(Path(__file__).resolve().parents[3]),
        "prefix": prefix or sys.prefix,
        "base": sys.base_prefix,
        "home": outer.get("HOME", ""),
    }
    return tuple(sorted(found.items(), key=lambda item: (-len(item[1]), item[0])))
