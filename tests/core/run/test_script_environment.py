"""What scripts find around them, and what of it their results depend on."""

from __future__ import annotations

import os
import platform
import sys
from pathlib import Path

from coursebuild.core.run.script_environment import conditions, places, wanted_packages

OUTER = {"PATH": "/bin", "HOME": "/home/me", "USER": "me", "LANG": "de", "SECRET": "x"}


def test_who_runs_a_script_and_where_says_nothing() -> None:
    other = {"PATH": "/usr/bin", "HOME": "/root", "USER": "root", "VIRTUAL_ENV": "/v", "TERM": "x"}
    assert conditions(OUTER) == conditions(other) == conditions({})


def test_what_decides_how_something_is_drawn_or_computed() -> None:
    told = dict(conditions({**OUTER, "MUJOCO_GL": "egl", "CUDA_VISIBLE_DEVICES": "1"}))
    assert told["environment variable MUJOCO_GL"] == "egl"
    assert told["environment variable CUDA_VISIBLE_DEVICES"] == "1"
    assert set(told) - set(dict(conditions(OUTER))) == {
        "environment variable MUJOCO_GL",
        "environment variable CUDA_VISIBLE_DEVICES",
    }


def test_the_interpreter_and_the_system() -> None:
    told = dict(conditions(OUTER))
    assert told["Python"] == f"{platform.python_implementation()} {platform.python_version()}"
    assert told["platform"].startswith(f"{sys.platform} {platform.machine()}")
    assert list(told) == sorted(told)


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
