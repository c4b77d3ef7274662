"""The environment of scripts, the part of it that results depend on, and the machine in reports."""

from __future__ import annotations

import contextlib
import importlib
import os
import platform
import sys
from pathlib import Path

import pytest

from coursebuild.core.run.script_environment import (
    conditions,
    cpu_name,
    find_cpu_name,
    machine,
    package_version,
    places,
    wanted_packages,
)
from support.fixture_cases import fixture_text


def test_conditions_do_not_depend_on_the_user() -> None:
    user_environment = {"PATH": "/bin", "HOME": "/home/me", "USER": "me"}
    user_environment |= {"LANG": "de", "SECRET": "x"}
    empty_conditions = conditions({})
    assert conditions(user_environment) == empty_conditions
    python = f"{platform.python_implementation()} {platform.python_version()}"
    assert dict(empty_conditions)["Python"] == python
    assert dict(empty_conditions)["platform"].startswith(f"{sys.platform} {platform.machine()}")
    graphics = {"CUDA_VISIBLE_DEVICES": "1", "MUJOCO_GL": "egl"}
    additions = [(f"environment variable {name}", value) for name, value in graphics.items()]
    expected = tuple(sorted((*empty_conditions, *additions)))
    assert conditions(user_environment | graphics) == expected


def test_a_distribution_without_a_version_is_not_installed(tmp_path: Path) -> None:
    with contextlib.suppress(ImportError):  # answers as well once it is imported, and raises
        importlib.import_module("importlib_metadata")
    folder = tmp_path / "mujoco-3.0.0.dist-info"
    folder.mkdir()
    assert package_version("mujoco", [str(tmp_path)]) == "none"
    os.mkfifo(folder / "METADATA")  # as a stranger's environment may have it
    assert package_version("mujoco", [str(tmp_path)]) == "none"
    (folder / "METADATA").unlink()
    (folder / "METADATA").write_text("Name: mujoco\nVersion: 3.0.0\n")
    assert package_version("mujoco", [str(tmp_path)]) == "3.0.0"


def test_places_come_longest_first() -> None:
    """A folder inside another must be found before that one."""
    folders = places(Path("/home/me/course"), {"HOME": "/home/me"})
    lengths = [len(folder) for _, folder in folders]
    assert lengths == sorted(lengths, reverse=True)
    assert dict(folders)["course"] == "/home/me/course"
    assert dict(folders)["home"] == "/home/me"
    assert dict(folders)["prefix"] == sys.prefix
    assert os.path.isdir(dict(folders)["library"])  # noqa: PTH112


def test_wanted_packages_are_named_in_the_folder_of_a_script(tmp_path: Path) -> None:
    cases = (
        (b"", ()),
        (b"import numpy as np", ("numpy",)),
        (b"import mjcourse\ndef f(:\0", ("numpy",)),
        (b"import numpydoc, mujocox", ()),
        (b"if x:\n    import os, mujoco as m", ("numpy", "mujoco")),
    )
    os.mkfifo(tmp_path / "pipe.py")
    for code, packages in cases:
        for name in ("x.py", "beside.py"):
            (tmp_path / name).write_bytes(code)
            assert wanted_packages([tmp_path / "none.py", tmp_path / "x.py"]) == packages, code
            (tmp_path / name).unlink()


X86 = fixture_text("documents/cpuinfo_x86.txt")
ARM = "processor\t: 0\nBogoMIPS\t: 50.00\nCPU implementer\t: 0x41\n\nModel\t\t: A Board Rev 1.1\n"


@pytest.mark.parametrize(
    ("text", "name"),
    [
        (X86, "A Processor @ 2.00GHz"),
        (ARM, "A Board Rev 1.1"),
        ("model name\t:\nHardware\t: A Chip\n", "A Chip"),
        ("", ""),
        ("no colon", ""),
        (f"model name: {'x' * 500}", "x" * 100),
    ],
)
def test_names_of_processors(text: str, name: str) -> None:
    assert find_cpu_name(text) == name


def test_this_machine() -> None:
    this_machine = machine()
    assert this_machine.engine.count(".") == 2
    assert this_machine.system
    assert this_machine.cpu == cpu_name()
    assert "\n" not in this_machine.cpu
