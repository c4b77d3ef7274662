"""The conditions under which a result holds: what is told of the machine, and what is not."""

from __future__ import annotations

import os
import platform
import sys
from pathlib import Path

from coursebuild.core.run.conditions import conditions, places

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
