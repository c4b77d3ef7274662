"""The files that MuJoCo opens for a model are known, though it opens them in C.

Each case is a course of small files and a script. What is noted suffices: with these files alone
the script does the same. And it is needed: without any one of them it does not.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from coursebuild.core.model.results import ScriptJob, ScriptRun
from coursebuild.core.run.script_environment import clean_environment
from coursebuild.core.run.script_server import ScriptServer
from support.fixture_cases import fixture_text
from support.model_files import TETRAHEDRON, png

pytestmark = pytest.mark.site


CASES = tomllib.loads(fixture_text("scripts/model_files.toml"))


SHOW = fixture_text("scripts/show_model.txt")


def write(root: Path, files: dict[str, str]) -> None:
    for name, text in files.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        match text.split(" "):
            case ["obj", size]:
                (root / name).write_text(TETRAHEDRON.replace("1 0 0", f"{size} 0 0"))
            case ["png", number]:
                (root / name).write_bytes(png(int(number)))
            case _:
                (root / name).write_text(text)


def run(server: ScriptServer, root: Path, script: str) -> ScriptRun:
    write(root, {"examples/x.py": SHOW + script})
    (result,) = server.run(root, [ScriptJob("examples/x.py", (), 120.0, ())], parallel=1)
    return result


def noted_files(result: ScriptRun) -> set[str]:
    assert result.trace is not None
    return {name for name in result.trace.files if not name.endswith(".py")}


@pytest.mark.parametrize("name", CASES)
def test_the_files_of_a_model(name: str, tmp_path: Path, server: ScriptServer) -> None:
    case = CASES[name]
    files, script = case.get("files", {}), case.get("script", "show(load('models/m.xml'))")
    needed_files = files.keys() - {case.get("spare")}
    root, alone = tmp_path / "course", tmp_path / "alone"
    write(root, files)
    result = run(server, root, script)
    assert (result.status, result.stderr) == (0, "") and result.trace is not None
    noted_files = {name for name in result.trace.files if not name.endswith(".py")}
    assert noted_files == needed_files | ({case["missing"]} if "missing" in case else set())
    assert result.trace.opaque == ""

    write(alone, {path: files[path] for path in needed_files})
    assert run(server, alone, script).stdout == result.stdout, "what was noted does not suffice"
    for path in needed_files:
        (alone / path).unlink()
        changed_run = run(server, alone, script)
        assert (changed_run.status, changed_run.stdout) != (0, result.stdout), (
            f"{path} is not needed"
        )
        write(alone, {path: files[path]})


def test_files_that_mujoco_writes_and_plugins_that_it_loads(
    tmp_path: Path, server: ScriptServer
) -> None:
    (tmp_path / "plugins").mkdir()
    writes, loads = "it writes files of the project", "it loads native code of the project"
    for call, reason in {
        "mujoco.mj_saveLastXML('out.xml', model)": writes,
        "mujoco.mj_saveModel(model, 'out.mjb')": writes,
        "mujoco.mj_printModel(model, 'out.txt')": writes,
        "mujoco.mj_printData(model, mujoco.MjData(model), 'out.txt')": writes,
        "Spec().to_file('out.xml')": writes,
        "mujoco.mj_loadAllPluginLibraries('plugins')": loads,
    }.items():
        result = run(server, tmp_path, f"model = text('<mujoco/>')\n{call}\n")
        assert result.trace is not None and result.trace.opaque == reason, call


def test_wrappers_look_like_what_they_wrap(tmp_path: Path, server: ScriptServer) -> None:
    code = (
        "for f in (load, text, Spec.from_file, Spec.compile, Spec().attach, mujoco.mj_saveModel):"
        "\n"
        "    print(f.__name__, f.__qualname__, f.__module__, f.__doc__)\n"
        "print(mujoco.mj_saveModel is mujoco._functions.mj_saveModel, Spec().compile.__self__)\n"
    )
    environment = clean_environment(os.environ)
    (tmp_path / "bare.py").write_text(SHOW + code)
    bare = subprocess.run(
        [sys.executable, tmp_path / "bare.py"], env=environment, capture_output=True, check=True
    )
    addresses = re.compile(r" at 0x\w+")
    expected = addresses.sub("", bare.stdout.decode())
    assert addresses.sub("", run(server, tmp_path, code).stdout) == expected
