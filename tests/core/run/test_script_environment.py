"""What scripts find around them, and what of it their results depend on."""

from __future__ import annotations

import os
import platform
import sys
from pathlib import Path

from coursebuild.core.run.script_environment import conditions, places, wanted_packages


def test_conditions_are_what_decides_a_result_and_not_who_runs_it_where() -> None:
    who = {"PATH": "/bin", "HOME": "/home/me", "USER": "me", "LANG": "de", "SECRET": "x"}
    told = conditions({})
    assert conditions(who) == told
    assert dict(told)["Python"] == f"{platform.python_implementation()} {platform.python_version()}"
    assert dict(told)["platform"].startswith(f"{sys.platform} {platform.machine()}")
    drawn = conditions({**who, "MUJOCO_GL": "egl", "CUDA_VISIBLE_DEVICES": "1"})
    more = ("CUDA_VISIBLE_DEVICES", "1"), ("MUJOCO_GL", "egl")
    assert drawn == tuple(sorted((*told, *((f"environment variable {n}", v) for n, v in more))))


def test_places_come_longest_first() -> None:
    """So that a folder inside of another is found before it."""
    found = places(Path("/home/me/course"), {"HOME": "/home/me"})
    assert [len(folder) for _, folder in found] == sorted(
        (len(folder) for _, folder in found), reverse=True
    )
    assert dict(found)["course"] == "/home/me/course"
    assert dict(found)["home"] == "/home/me"
    assert dict(found)["prefix"] == sys.prefix
    assert os.path.isdir(dict(found)["library"])  # noqa: PTH112


def test_packages_are_wanted_that_a_script_or_a_file_beside_it_names(tmp_path: Path) -> None:
    cases = (
        (b"", ()),
        (b"import numpy as np", ("numpy",)),
        (b"import mjcourse\ndef f(:\0", ("numpy",)),
        (b"import numpydoc, mujocox", ()),
        (b"if x:\n    import os, mujoco as m", ("numpy", "mujoco")),
    )
    os.mkfifo(tmp_path / "pipe.py")
    for code, wanted in cases:
        for name in ("x.py", "beside.py"):
            (tmp_path / name).write_bytes(code)
            assert wanted_packages([tmp_path / "none.py", tmp_path / "x.py"]) == wanted, code
            (tmp_path / name).unlink()
