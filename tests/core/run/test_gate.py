"""Processes start through the gate alone, and take nothing from the folder they are started in."""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from coursebuild.core.run import gate
from support.fixture_cases import fixture_tables, fixture_text
from support.waiting import wait_until

ROOT = Path(__file__).parents[3]
MODULES = "subprocess multiprocessing concurrent.futures.process pty webbrowser asyncio.subprocess"
CALLS = fixture_text("scripts/calls.txt")
ELSEWHERE = {
    # A copy of the process itself starts no program.
    ("coursebuild/core/engine/page_pool.py", "os.fork"),
    ("benchmarks/mistakes.py", "multiprocessing"),
    ("benchmarks/mistakes.py", "concurrent.futures.ProcessPoolExecutor"),
    ("benchmarks/mutations.py", "multiprocessing"),
    # What the gate starts first, which then becomes what was asked for.
    ("coursebuild/core/engine/lifetime.py", "os.execvp"),
    ("coursebuild/core/run/sandbox_main.py", "os.execv"),
    # The supervisor of scripts, which the gate has started, starts them as scripts are.
    ("coursebuild/core/run/supervisor.py", "os.fork"),
    ("coursebuild/core/run/supervisor.py", "subprocess"),
    ("coursebuild/core/run/supervisor.py", "multiprocessing"),
    # The process of a script becomes what the map names for its language.
    ("coursebuild/core/run/script_process.py", "os.execvp"),
    ("coursebuild/core/run/script_process.py", "subprocess"),
    # mjbench imports nothing of coursebuild: an engine, whose Python takes nothing from the folder
    # since the command has set `PYTHONSAFEPATH`, and the processor's name.
    ("mjbench/mjbench/engines/engine_trial.py", "multiprocessing"),
    ("mjbench/mjbench/machine.py", "subprocess"),
}
"""Other places where a process may begin: files, and what they use."""


def starts(tree: ast.AST) -> Iterator[str]:
    """What code names that starts processes, however it imports it."""
    modules, calls = MODULES.split(), CALLS.split()
    last_words = {name.rpartition(".")[2] for name in (*modules, *calls)}
    for node in ast.walk(tree):
        names: list[str] = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            names = [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
        elif isinstance(node, ast.Attribute) and node.attr in last_words:
            names = [ast.unparse(node)]
        for name in names:
            if name in modules or name in calls:
                yield name


def test_nothing_else_starts_a_process() -> None:
    files = [
        p
        for top in ("coursebuild", "mjcourse", "mjbench/mjbench", "plugins", "benchmarks")
        for p in (ROOT / top).rglob("*.py")
        if "node_modules" not in p.parts
    ]
    places = {
        (file.relative_to(ROOT).as_posix(), name)
        for file in files
        for name in starts(ast.parse(file.read_bytes()))
    }
    places = {place for place in places if place[0] != "coursebuild/core/run/gate.py"}
    assert places == ELSEWHERE


@pytest.mark.parametrize("code", fixture_tables("processes")["ways"])
def test_each_way_to_start_one_is_seen(code: str) -> None:
    assert list(starts(ast.parse(code)))


def test_waiting_for_a_pipe_starts_none() -> None:
    assert not list(starts(ast.parse("from multiprocessing.connection import wait")))


SHOW = "import os, sys; print(os.getcwd(), os.listdir(), sys.path[0], dict(os.environ), sep='\\n')"


def test_a_process_works_in_an_empty_private_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("os.py", "encodings.py", "sitecustomize.py"):
        Path(name).write_text("raise SystemExit(7)\n")
    show = gate.python_command("-c", SHOW), gate.environment()
    lasting, _ = gate.start(*show, stdout=gate.PIPE).communicate()
    assert not lasting.startswith(bytes(tmp_path))
    done = gate.finish(*show)
    folder, entries, first, _ = done.output.decode().splitlines()
    assert (done.status, entries) == (0, "[]")
    assert not Path(folder).is_relative_to(tmp_path)
    assert not Path(folder).exists()  # it ended with the process
    assert first not in ("", folder, str(tmp_path))


def test_what_it_starts_in_turn_has_a_safe_path_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "colorsys.py").write_text("print('trap')\n")
    inner = "import subprocess, sys; subprocess.run([sys.executable, '-c', 'import colorsys'])"
    code = f"import os; os.chdir({str(tmp_path)!r}); exec({inner!r})"
    done = gate.finish(gate.python_command("-c", code), gate.environment())
    assert (done.status, done.output, done.errors) == (0, b"", b"")


def test_the_environment_is_what_a_purpose_needs(monkeypatch: pytest.MonkeyPatch) -> None:
    dangerous = "PYTHONPATH PYTHONSTARTUP GIT_DIR NODE_OPTIONS LD_PRELOAD SECRET".split()
    for name in dangerous:
        monkeypatch.setenv(name, "x")
    for name in ("HTTPS_PROXY", "PIP_INDEX_URL", "UV_INDEX_URL", "LC_NUMERIC", "DISPLAY"):
        monkeypatch.setenv(name, "y")
    monkeypatch.setenv("PATH", ".:bin::/usr/bin:../x:/bin")
    plain = gate.environment(EXTRA="1")
    assert plain["PATH"] == "/usr/bin:/bin"
    assert (plain["PYTHONSAFEPATH"], plain["EXTRA"], plain["LC_NUMERIC"]) == ("1", "1", "y")
    assert not plain.keys() & {*dangerous, "HTTPS_PROXY", "PIP_INDEX_URL", "DISPLAY"}
    of_installers = gate.environment(*gate.INSTALLERS)
    assert of_installers.keys() >= {"HTTPS_PROXY", "PIP_INDEX_URL", "UV_INDEX_URL"}


def test_programs_are_found_in_absolute_places(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for path in ("git", "bin/git", "good/git"):
        Path(path).parent.mkdir(exist_ok=True)
        Path(path).write_text("#!/bin/sh\n")
        Path(path).chmod(0o755)
    monkeypatch.setenv("PATH", f".:bin::{tmp_path}/good")
    assert gate.find_program("git") == f"{tmp_path}/good/git"
    assert gate.find_program("./git") is gate.find_program("bin/git") is None
    assert gate.find_program(f"{tmp_path}/git") == f"{tmp_path}/git"


@pytest.mark.site
def test_a_process_that_takes_too_long_is_ended_with_its_children(tmp_path: Path) -> None:
    mark = tmp_path / "mark"
    command = ["/bin/sh", "-c", f"sleep 600 & echo $! > '{mark}'; wait"]
    with pytest.raises(TimeoutError, match="longer than 4 s"):
        gate.finish(command, gate.environment(), seconds=4.0)
    child = Path(f"/proc/{mark.read_text().strip()}/stat")
    wait_until(lambda: not child.exists() or is_zombie(child), "the end of the child")


def is_zombie(stat: Path) -> bool:
    return stat.read_text().rpartition(")")[2].split()[0] == "Z"


def test_modules_are_run_from_where_this_process_has_them(tmp_path: Path) -> None:
    command = gate.module_command("coursebuild", "--version")
    done = gate.finish(command, gate.environment())
    assert (done.status, done.output.startswith(b"coursebuild ")) == (0, True), done.errors
    assert command[:3] == [sys.executable, "-E", "-P"]
