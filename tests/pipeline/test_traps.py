"""Nothing that lies in a course's folder runs by accident, whichever command is given there."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from coursebuild.cli.commands import known_commands
from support.editor import Editor
from support.fixture_cases import fixture_text
from support.local_cluster import install_plugin
from support.scratch_course import Folder, kill_at_end, processes
from support.traps import COMMANDS, OF_MJBENCH, TrapFolder, mjbench, tool, variables

ROOT = Path(__file__).parents[2]
STARTED_IN_TESTS_OF_THEIR_OWN = {"lsp", "serve"}
EACH = [
    pytest.param(command, id=" ".join(command)) for group in COMMANDS.values() for command in group
]


@pytest.fixture
def traps(tmp_path: Path, stores: Path) -> TrapFolder:
    folder = Folder(tmp_path / "a cöurse")
    traps = TrapFolder(folder)
    folder.borrow(stores)
    return traps


def run(
    traps: TrapFolder, command: list[str], **more_variables: str
) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        command,
        cwd=traps.folder.root,
        env=traps.folder.environment(variables(**more_variables)),
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
    )


def test_every_command_is_tried() -> None:
    assert {*COMMANDS, *STARTED_IN_TESTS_OF_THEIR_OWN} == {*known_commands(), "help"}


@pytest.mark.site
@pytest.mark.parametrize("command", EACH)
def test_no_trap_runs(traps: TrapFolder, command: tuple[str, ...]) -> None:
    result = run(traps, tool(*command))
    assert (traps.marks(), "Traceback" in result.stderr) == ([], False), result.stderr
    assert result.returncode < 2, "the command was not understood"
    if command[0] in ("build", "check") and "--against" not in command:
        assert result.stdout.endswith("everything holds\n")  # all that a course needs was started


@pytest.mark.site
def test_a_path_without_absolute_places_counts_as_that_of_the_system(traps: TrapFolder) -> None:
    result = run(traps, tool("check"), PATH=".:")
    assert traps.marks() == []
    assert result.stdout.endswith("everything holds\n"), result.stdout  # `sh` was found


@pytest.mark.site
@pytest.mark.parametrize("words", OF_MJBENCH, ids=" ".join)
def test_no_trap_runs_as_a_model_is_measured(traps: TrapFolder, words: tuple[str, ...]) -> None:
    result = run(traps, mjbench(*words))
    assert (traps.marks(), result.returncode) == ([], 0), result.stderr


@pytest.mark.long
def test_no_trap_runs_on_a_cluster(traps: TrapFolder, tmp_path: Path) -> None:
    (tmp_path / "packages").mkdir()
    path = install_plugin(tmp_path / "packages")
    command = tool("check", "--cluster", "local")
    result = run(traps, command, PYTHONPATH=path, PYTHONWARNINGS="ignore")
    assert (traps.marks(), result.stdout.endswith("everything holds\n")) == ([], True), (
        result.stderr
    )


@pytest.mark.site
def test_no_trap_runs_while_a_course_is_served(traps: TrapFolder) -> None:
    folder = traps.folder
    process = subprocess.Popen(
        tool("serve", "--port", "0", "--open"),
        cwd=folder.root,
        env=folder.environment(variables(VISUAL="./code")),
        stdin=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )
    with kill_at_end(process):  # type: ignore[arg-type]
        assert process.stderr is not None
        output = ""
        while "everything holds" not in output and process.poll() is None:
            output += process.stderr.readline()
        process.send_signal(signal.SIGINT)
        output += process.stderr.read()
        process.wait()
    assert (traps.marks(), "everything holds" in output) == ([], True), output


@pytest.mark.site
def test_no_trap_runs_in_an_editor(traps: TrapFolder) -> None:
    folder = traps.folder
    editor = Editor(folder, tool("lsp"), **variables())
    try:
        editor.write(folder.lesson(), folder.text(folder.lesson()))
        editor.save(folder.lesson())  # from now on scripts run
        editor.wait_for(lambda: (folder.root / "examples/falls.py").is_file())
        editor.hover_text(folder.lesson(), "`mujoco.mj_st|ep`")
    finally:
        editor.close()
    assert traps.marks() == []


@pytest.mark.site
def test_no_trap_runs_in_a_run_of_pytest(traps: TrapFolder) -> None:
    """Its own settings in the folder are obeyed, as pytest's rules are; ours are not sought."""
    folder = traps.folder
    for host in ("conftest.py", "setup.cfg", "pyproject.toml"):
        (folder.root / host).unlink()
    result = subprocess.run(
        [sys.executable, "-P", "-m", "pytest", "-q", "--coursebuild", "-p", "no:cacheprovider"],
        cwd=folder.root,
        env=folder.environment(variables()),
        capture_output=True,
        text=True,
    )
    assert traps.marks() == [], result.stdout
    assert "passed" in result.stdout, result.stdout + result.stderr


@pytest.mark.site
def test_no_trap_runs_in_a_hook_or_an_action(traps: TrapFolder, tmp_path: Path) -> None:
    """The lines that pre-commit and a workflow give to a shell, each in the course's folder."""
    hooks = yaml.safe_load((ROOT / ".pre-commit-hooks.yaml").read_text())
    action = yaml.safe_load((ROOT / "action.yml").read_text())
    lines = [hook["entry"] for hook in hooks]
    lines += [step["run"] for step in action["runs"]["steps"] if "run" in step]
    pip = tmp_path / "bin/pip"  # there is no index to install from
    pip.parent.mkdir()
    pip.write_text("#!/bin/sh\necho pip\n")
    pip.chmod(0o755)
    paths = [str(pip.parent), str(Path(sys.executable).parent), os.environ["PATH"]]
    environment = {
        "COMMAND": action["inputs"]["command"]["default"],
        "GITHUB_ACTION_PATH": str(ROOT),
        "PATH": ":".join(paths),
        "RUNNER_TEMP": str(tmp_path),
    }
    results = [run(traps, ["bash", "-e", "-c", line], **environment) for line in lines]
    assert traps.marks() == []
    assert [result.returncode for result in results] == [0, 0, 0, 0], results
    assert results[2].stdout == "pip\n" * 3 and "trying labs" in results[3].stderr


WITHOUT_MUJOCO = fixture_text("scripts/without_mujoco.txt")


@pytest.mark.site
@pytest.mark.parametrize("command", ["check", "build"])
def test_the_tool_imports_no_mujoco_and_has_no_course_on_its_path(
    traps: TrapFolder, command: str
) -> None:
    result = subprocess.run(
        [sys.executable, "-P", "-c", WITHOUT_MUJOCO, command, "--no-cache"],
        cwd=traps.folder.root,
        env=traps.folder.environment(variables()),
        capture_output=True,
        text=True,
    )
    assert (result.returncode, traps.marks()) == (0, []), result.stdout + result.stderr
    assert "1 lab tried" in result.stdout


def test_traps_work(traps: TrapFolder) -> None:
    """Python that is started in the folder, as the tool must not do it, runs one."""
    command = [sys.executable, "-c", "import colorsys"]
    subprocess.run(command, cwd=traps.folder.root, check=False, capture_output=True)
    # Python 3.13 imports modules of its own for `-c`, and meets a trap there.
    assert any(mark.startswith("module ") for mark in traps.marks())
    assert processes(traps.folder) == []
