"""Scripts in the sandbox try to get out of it.

Where a machine can have no sandbox, each of these tests looks at how it is refused, and says so.
"""

from __future__ import annotations

import os
import platform
import shutil
import socket
import subprocess
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest

from coursebuild.core.files.errors import EffectError
from coursebuild.core.model.results import Outcome, ScriptJob, ScriptRun
from coursebuild.core.run import sandbox
from coursebuild.core.run.sandbox import examine_sandbox, find_sandbox
from coursebuild.core.run.script_environment import Interpreter
from coursebuild.core.run.script_server import ScriptServer
from support.fixture_cases import fixture_text
from support.runners import wait_until_ended
from support.sandbox_probes import (
    CALLS,
    EXCESSES,
    KEY_NAME,
    SECRET,
    answers,
    attempts_script,
    surroundings,
)
from support.sandboxes import require_sandbox

pytestmark = pytest.mark.site

Confine = Callable[..., list[ScriptRun]]
SCRIPTS = tomllib.loads(fixture_text("sandbox.toml"))["scripts"]
"""Scripts, and the beginning of each, which prints the result of an attempt, or its error."""


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    home = tmp_path / "home"
    home.mkdir()
    (home / "secret").write_text("hush")
    monkeypatch.setenv("HOME", str(home))
    return home


@pytest.fixture
def confine(root: Path, home: Path) -> Confine:
    """Runs scripts in the sandbox, one after the other."""

    def confine(*codes: str, **options: object) -> list[ScriptRun]:
        jobs = []
        for number, code in enumerate(codes):
            (root / f"examples/x{number}.py").write_text(SCRIPTS["attempt"] + code)
            jobs.append(ScriptJob(f"examples/x{number}.py", (), 60.0, (), **options))
        with ScriptServer(sandbox=require_sandbox(root)) as server:
            return list(server.run(root, jobs, parallel=1))

    return confine


def test_attempts_fail_and_change_nothing(root: Path, home: Path, confine: Confine) -> None:
    with surroundings(root, home) as names:
        (run,) = confine(attempts_script(names), writes=("runs",))
    assert not answers(run)
    assert SECRET not in run.stdout + run.stderr
    left = {"examples", "lesson.md", "stream", "deep", "datagrams", "pipe", "runs", "linked-pipe"}
    assert {path.name for path in root.iterdir()} == left


def test_a_key_of_the_user_is_out_of_reach_without_the_filter(
    root: Path, home: Path, tmp_path: Path
) -> None:
    program = tmp_path / "bwrap"
    search = "import ctypes\nprint(ctypes.CDLL(None).syscall(%d, 10, -3, b'user', b'%s', 0))"
    program.write_text(f"#!{sys.executable}\n{search % (CALLS['keyctl'], KEY_NAME)}")
    program.chmod(0o755)
    with surroundings(root, home) as names:
        outside, inside = (
            subprocess.run([*start, program], capture_output=True, text=True).stdout
            for start in ([sys.executable], [sys.executable, sandbox.PROGRAM, ""])
        )
    assert int(outside) in (names["KEY"], -1)  # -1: this machine has no keys
    assert int(inside) == -1


@pytest.mark.parametrize("name", EXCESSES)
def test_limits_hold_for_all_that_a_script_starts(root: Path, home: Path, name: str) -> None:
    excess = EXCESSES[name]
    (root / "examples/x.py").write_text(excess.code)
    job = ScriptJob("examples/x.py", (), excess.timeout, (), memory=excess.memory)
    with ScriptServer(sandbox=require_sandbox(root)) as server:
        (run,) = server.run(root, [job], parallel=1)
    assert run.outcome is excess.outcome and excess.message in run.stderr, run.stderr


def test_an_interpreter_of_the_course_that_never_reports(root: Path) -> None:
    """A course can bring the supervisor itself, which then has begun, it says, and goes on."""
    python = root / ".venv/bin/python"
    python.parent.mkdir(parents=True)
    code = "import os, sys, time; os.write(int(sys.argv[3]), bytes(4)); time.sleep(600)"
    python.write_text(f"#!{sys.base_prefix}/bin/python3 -IS\n{code}\n")
    python.chmod(0o755)
    (root / "examples/x.py").write_text("")
    prefix = str(root / ".venv")
    interpreter = Interpreter("", str(python), prefix, sys.base_prefix, "3.11.0", "3", ())
    with ScriptServer(sandbox=require_sandbox(root)) as server:
        job = ScriptJob("examples/x.py", (), 0.5, ())
        (run,) = server.run(root, [job], parallel=1, interpreter=interpreter)
    assert run.outcome is Outcome.TIMEOUT
    fault = "what ran in it did not end at its time limit"
    assert run.stderr == f"its sandbox was stopped, because {fault}\n"


def test_the_network_by_address_and_by_name(confine: Confine) -> None:
    with socket.create_server(("127.0.0.1", 0)) as tcp:
        port = tcp.getsockname()[1]
        (run,) = confine(SCRIPTS["network"].replace("PORT", str(port)))
        tcp.setblocking(False)
        with pytest.raises(BlockingIOError):
            tcp.accept()
    refused, unreachable, by_name, unknown = run.stdout.splitlines()
    assert refused.startswith("ConnectionRefusedError")
    assert unreachable.startswith("OSError")
    assert by_name.startswith(("ConnectionRefusedError", "gaierror", "OSError"))
    assert unknown.startswith("gaierror")
    assert run.trace is not None
    addresses = ["127.0.0.1", "192.0.2.1", "localhost", "example.org"]
    assert [effect.target for effect in run.trace.effects] == addresses


def test_environments_and_files_of_other_processes(
    confine: Confine, home: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("GITHUB_TOKEN", "hush")
    with (home / "secret").open() as secret_file:
        os.set_inheritable(secret_file.fileno(), True)
        (run,) = confine(SCRIPTS["other processes"])
    assert not any(word in run.stdout for word in ("hush", "GITHUB_TOKEN", "secret"))
    assert "/dev/null" in run.stdout


def test_script_that_kills_all_it_can_ends_alone(confine: Confine) -> None:
    kill = "os.kill(os.getppid(), 15)\nattempt(lambda: os.kill(-1, 9))\n"
    first, second = confine(kill, "print('as before')")
    assert first.stdout == "ProcessLookupError [Errno 3] No such process\n"
    assert (second.outcome, second.stdout) == (Outcome.OK, "as before\n")


def test_forging_the_report_of_another_script(confine: Confine) -> None:
    texts = (b"\xff" * 64, b"\0\0\0\2{}", b'\0\0\0\x0c{"parts":[]}' + b"x" * 9)
    *forged, last = confine(
        *(SCRIPTS["forge"].replace("TEXT", repr(text)) for text in texts), "print('mine')"
    )
    assert all(run.outcome in (Outcome.KILLED, Outcome.OK) for run in forged)
    assert (last.outcome, last.stdout) == (Outcome.OK, "mine\n")


def test_a_process_that_stays(confine: Confine) -> None:
    mark = f"600.{os.getpid()}"
    (run,) = confine(SCRIPTS["stay"].replace("MARK", mark))
    assert run.outcome is Outcome.OK, run.stderr
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            is_sleeper = mark.encode() in path.read_bytes()
        except OSError:
            continue
        assert not is_sleeper or wait_until_ended(int(path.parent.name))


def test_filling_the_disk(confine: Confine, root: Path) -> None:
    (run,) = confine(SCRIPTS["fill"], writes=("runs",))
    assert run.stdout.splitlines() == ["OSError [Errno 28] No space left on device"] * 5
    assert not list(root.glob("runs/*"))


def test_links_that_the_tool_would_follow(confine: Confine, root: Path, home: Path) -> None:
    secret = str(home / "secret")
    (root / "linked").symlink_to(home)
    code = SCRIPTS["link"].replace("SECRET", secret)
    (run,) = confine(code, figures=("a.csv", "b.csv"), writes=("runs", "linked"))
    assert run.outcome is Outcome.OK, run.stderr
    assert run.figures == ()
    assert run.stdout.startswith("FileNotFoundError")
    assert not list(root.glob("runs/*"))
    assert [path.name for path in home.iterdir()] == ["secret"]


class TestResults:
    """Well-behaved scripts do the same as outside."""

    @pytest.fixture(autouse=True)
    def course(self, root: Path) -> None:
        for path, text in {
            "models/a.xml": "<mujoco><worldbody><geom size='1'/></worldbody></mujoco>",
            "examples/helper.py": "VALUE = 3",
            "runs/old.csv": "old",
        }.items():
            (root / path).parent.mkdir(exist_ok=True)
            (root / path).write_text(text)

    def test_they_are_the_same(self, confine: Confine, root: Path) -> None:
        (inside,) = confine(SCRIPTS["as outside"], figures=("a.csv",))
        job = ScriptJob("examples/x0.py", (), 60.0, (), figures=("a.csv",))
        with ScriptServer() as server:
            (outside,) = server.run(root, [job], parallel=1)
        assert outside.outcome is Outcome.OK, outside.stderr
        for name in ("outcome", "stdout", "stderr", "figures", "trace"):
            assert getattr(inside, name) == getattr(outside, name)

    def test_processes_threads_and_memory_that_they_share(self, confine: Confine) -> None:
        (run,) = confine(fixture_text("scripts/shared_memory.txt"))
        assert run.stdout == "[1, 2]\n" * 2 + "[3]\n" * 2 + "2 (b'', 0)\n", run.stderr

    def test_what_is_written_is_seen_and_goes(self, confine: Confine, root: Path) -> None:
        code = "open('runs/new', 'w').write(open('runs/old.csv').read())\nprint(os.listdir('runs'))"
        (run,) = confine(f"open('runs/old.csv', 'a').write('er')\n{code}", writes=("runs",))
        assert run.stdout == "['old.csv', 'new']\n" or run.stdout == "['new', 'old.csv']\n"
        assert run.trace is not None
        assert run.trace.opaque == "what it wrote was lost with its sandbox"
        assert [path.name for path in root.glob("runs/*")] == ["old.csv"]
        assert (root / "runs/old.csv").read_text() == "old"

    def test_trace_of_a_file_that_is_not_shown_is_opaque(
        self, confine: Confine, home: Path
    ) -> None:
        (run,) = confine("attempt(lambda: open(os.path.expanduser('~/secret')))")
        assert run.trace is not None
        assert run.trace.opaque == f"its sandbox does not show {home}/secret"


class TestRefusals:
    @pytest.fixture
    def programs(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
        """The only folder on PATH."""
        folder = tmp_path / "programs"
        folder.mkdir()
        monkeypatch.setenv("PATH", str(folder))
        return folder

    def test_what_is_no_sandbox(self, programs: Path, root: Path) -> None:
        for code, problem in {
            "echo 'bwrap: no uid map' >&2\nexit 1": ", Bubblewrap says: no uid map",
            'while [ "$1" != -- ]; do shift; done; shift; exec "$@"': (
                ": the supervisor is not the first process in the sandbox"
            ),
        }.items():
            _write_bwrap(programs, code)
            with pytest.raises(EffectError) as refused:
                find_sandbox(root)
            assert refused.value.message == f"`--sandbox` does not work here{problem}"
            assert "kernel.apparmor_restrict_unprivileged_userns" in refused.value.help

    def test_what_never_starts(self, programs: Path, root: Path) -> None:
        _write_bwrap(programs, f"exec {shutil.which('sleep', path=os.defpath)} infinity")
        _, (*_, part) = examine_sandbox(root, 0.1)
        problem = "does not work here: a sandbox does not start and end within 0.1 s"
        assert part.problem == problem

    def test_machine_without_a_filter(
        self, programs: Path, root: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        _write_bwrap(programs, "")
        monkeypatch.setattr(platform, "machine", lambda: "riscv64")
        _, (*_, part) = examine_sandbox(root)
        problem = "needs a filter of system calls, and there is none for riscv64 machines"
        assert part.problem == problem


def _write_bwrap(programs: Path, code: str) -> None:
    """Put a program in place of Bubblewrap."""
    (programs / "bwrap").write_text(f"#!/bin/sh\n{code}\n")
    (programs / "bwrap").chmod(0o755)
