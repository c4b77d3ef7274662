"""Supervisors stay warm, are replaced when they must; scripts in copies of them are kept apart."""

from __future__ import annotations

import functools
import os
import re
import signal
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Mapping
from pathlib import Path

import pytest

from coursebuild.core.model.results import Outcome, ScriptRun
from coursebuild.core.run.script_environment import (
    Interpreter,
    clean_environment,
    library_folder,
    python_version,
)
from coursebuild.core.run.script_server import ScriptServer
from support.runners import Run, job, wait_until_ended
from support.scratch_course import ROOT

pytestmark = pytest.mark.site

ARGUMENTS = ("a b", "", "*", "é", "--flag=1", "\udc80")
SCRIPTS = tomllib.loads((ROOT / "tests/fixtures/probe_scripts.toml").read_text(encoding="utf-8"))
PROBES: dict[str, str] = SCRIPTS["probes"]
FAILURES: dict[str, list[str]] = SCRIPTS["failures"]
VisibleResult = tuple[str, str, int]


@functools.cache
def library() -> dict[str, str]:
    """The variable that lets a bare Python import `mjcourse`, if that is not installed."""
    command = [sys.executable, "-P", "-c", "import mjcourse"]
    lacks = subprocess.run(command, capture_output=True, cwd="/").returncode
    return {"PYTHONPATH": library_folder()} if lacks else {}


def run_alone(root: Path, path: str) -> VisibleResult:
    """The result of a script that Python itself runs."""
    # As short as the runner's own, because the path of a socket has few characters.
    with tempfile.TemporaryDirectory(prefix="bare-", dir="/tmp") as temporary:
        process = subprocess.run(
            [sys.executable, path, *ARGUMENTS],
            cwd=root,
            env=clean_environment(os.environ) | {"TMPDIR": temporary} | library(),
            stdin=subprocess.DEVNULL,
            capture_output=True,
            start_new_session=True,
        )
    out, err = (
        data.decode("utf-8", "backslashreplace").replace("\r\n", "\n")
        for data in (process.stdout, process.stderr)
    )
    return without_addresses(out), without_addresses(err), process.returncode


def without_addresses(text: str) -> str:
    """The text without what differs between any two runs."""
    return re.sub(r"0x[0-9a-f]{6,}", "0x…", re.sub(r"\b\d{15}\b", "…", text))


def visible_result(run: ScriptRun) -> VisibleResult:
    status = -run.status if run.outcome is Outcome.KILLED else run.status
    return without_addresses(run.stdout), without_addresses(run.stderr), status


def differences(server: ScriptServer, root: Path, scripts: Mapping[str, str]) -> list[str]:
    """How the results of scripts run by a server differ from Python's own, each with its name."""
    paths = [f"examples/script{number}.py" for number in range(len(scripts))]
    for path, code in zip(paths, scripts.values(), strict=True):
        encoding = "latin-1" if "latin-1" in code else "utf-8"
        (root / path).write_bytes(code.encode(encoding, "surrogatepass"))
    runs = server.run(root, [job(path, args=ARGUMENTS) for path in paths], parallel=2)
    lines = []
    for name, path, run in zip(scripts, paths, runs, strict=True):
        alone = run_alone(root, path)
        lines += [
            f"{name}: {ours!r}, but alone {theirs!r}"
            for ours, theirs in zip(visible_result(run), alone, strict=True)
            if ours != theirs
        ]
    return lines


def test_forked_script_finds_what_python_gives_it(forking: ScriptServer, root: Path) -> None:
    assert differences(forking, root.resolve(), PROBES) == []


def test_forked_script_fails_as_it_does_alone(forking: ScriptServer, root: Path) -> None:
    scripts = {f"{kind} {code!r}": code for kind in FAILURES for code in FAILURES[kind]}
    assert differences(forking, root.resolve(), scripts) == []


def test_spawned_script_does_what_it_does_alone(spawning: ScriptServer, root: Path) -> None:
    scripts = {"main": PROBES["main"], "numbers": PROBES["numbers"], "fails": FAILURES["errors"][0]}
    assert differences(spawning, root.resolve(), scripts) == []


# --- other installations


@pytest.fixture(scope="module")
def interpreter(tmp_path_factory: pytest.TempPathFactory) -> Interpreter:
    """An interpreter with no packages."""
    prefix = tmp_path_factory.mktemp("place") / "venv"
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", prefix], check=True)
    (packages,) = prefix.glob("lib/python*/site-packages")
    python, base, version = str(prefix / "bin/python"), sys.base_prefix, python_version()
    return Interpreter("", python, str(prefix), base, version, "none", (str(packages),))


def test_script_reports_a_package_that_is_not_installed(
    interpreter: Interpreter, root: Path
) -> None:
    code = "try: import numpy\nexcept ModuleNotFoundError as error: print(error)\n"
    (root / "examples/x.py").write_text(code)
    with ScriptServer() as server:
        (run,) = server.run(root, [job()], parallel=1, interpreter=interpreter)
    assert run.stdout == "No module named 'numpy'\n"


def test_package_that_cannot_be_preloaded_fails_in_scripts(
    interpreter: Interpreter, root: Path
) -> None:
    module = Path(*interpreter.packages, "numpy.py")
    thread = (
        "import threading\nthreading.Thread(target=threading.Event().wait, daemon=True).start()"
    )
    (root / "examples/x.py").write_text("print('begins', flush=True)\nimport numpy")
    outcomes = []
    for code in ("1 / 0", "raise SystemExit(3)", thread):
        module.write_text(code)
        with ScriptServer() as server:
            (run,) = server.run(root, [job()], parallel=1, interpreter=interpreter)
        outcomes.append((run.stdout, run.status))
    module.unlink()
    assert outcomes == [("begins\n", 1), ("begins\n", 3), ("begins\n", 0)]


def test_other_version_of_a_package_is_imported_anew(interpreter: Interpreter, root: Path) -> None:
    (root / "examples/x.py").write_text("import numpy\nprint(numpy.__version__)")
    module = Path(*interpreter.packages, "numpy.py")
    with ScriptServer() as server:
        for version in ("1", "22"):
            module.unlink(missing_ok=True)
            module.write_text(f"__version__ = '{version}'")
            runs = [
                server.run(root, [job()], parallel=1, interpreter=interpreter)[0].stdout
                for _ in range(2)
            ]
            assert runs == [f"{version}\n"] * 2
    module.unlink()


def supervisor_of(run: ScriptRun) -> int:
    assert run.outcome is Outcome.OK, run.stderr
    return int(run.stdout)


def test_supervisors_stay_and_one_that_died_is_replaced(root: Path) -> None:
    (root / "examples/x.py").write_text("import os, numpy\nprint(os.getppid())\n")
    with ScriptServer() as server:
        runs = [server.run(root, [job()] * 3, parallel=2) for _ in range(3)]
        assert len({supervisor_of(run) for several in runs for run in several}) == 2
        for number in (signal.SIGKILL, signal.SIGTERM, signal.SIGSEGV):
            dead = supervisor_of(server.run(root, [job()], parallel=1)[0])
            os.kill(dead, number)
            assert wait_until_ended(dead)
            events: list[str] = []
            after = server.run(root, [job()], parallel=1, on_start=events.append)
            assert supervisor_of(after[0]) != dead
            assert events == ["examples/x.py"], "it began once, whoever was to run it"


def test_environment_that_changes_is_seen(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    for value in ("egl", "osmesa"):
        monkeypatch.setenv("MUJOCO_GL", value)
        assert run("import os\nprint(os.environ['MUJOCO_GL'])").stdout == f"{value}\n"


def test_module_beside_the_script_comes_first(server: ScriptServer, root: Path) -> None:
    for name in ("random", "numpy", "json"):
        (root / f"examples/{name}.py").write_text("value = 'mine'\n")
    code = "import random, numpy, json\nprint(random.value, numpy.value, json.value)\n"
    (root / "examples/x.py").write_text(code)
    (root / "y.py").write_text("import numpy.linalg, json\nprint(json.dumps(1))")
    mine, theirs = server.run(root, [job(), job("y.py")], parallel=1)
    assert (mine.stdout, theirs.stdout) == ("mine mine mine\n", "1\n")


def test_scripts_do_not_share_random_numbers(server: ScriptServer, root: Path) -> None:
    code = "import random, numpy as np, uuid\nprint(random.random())\n"
    code += "print(np.random.rand())\nprint(uuid.uuid4())\n"
    (root / "examples/x.py").write_text(code)
    runs = server.run(root, [job()] * 4, parallel=2)
    assert len({line for run in runs for line in run.stdout.splitlines()}) == 12


def test_scripts_leave_nothing_to_each_other(server: ScriptServer, root: Path) -> None:
    for name, code in SCRIPTS["soil"].items():
        (root / f"examples/{name}.py").write_text(code)
    jobs = [job("examples/soil.py"), job("examples/look.py")]
    expected = "3.141592653589793 warn None False True True True 1000 0.6666666666666666\n"
    assert [run.stdout for run in server.run(root, jobs * 2, parallel=1)] == ["", expected] * 2
