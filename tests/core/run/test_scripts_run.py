"""Scripts, well-behaved and not: their results, and the environment that they find."""

from __future__ import annotations

import json
import os
import signal
import tempfile
import tomllib
from pathlib import Path

import pytest

from coursebuild.core.files.errors import EffectError
from coursebuild.core.model.results import Outcome
from coursebuild.core.run.script_environment import clean_environment
from coursebuild.core.run.script_server import ScriptServer
from support.fixture_cases import fixture_text
from support.run_code import program, run_code
from support.runners import SOURCE_TREE, TOOL, Run, both_ways, forked_or_not, job, run_hanging

pytestmark = pytest.mark.site

LIMIT = 1 << 20
"""Bytes that a script may print."""
WRITE = "import sys\nwrite = sys.stdout.buffer.write\n"
KILL = "import os\nprint('x', flush=True)\nos.kill({}, {})\n"
CASES: list[tuple[str, Outcome, int, str]] = [
    ("", Outcome.OK, 0, ""),
    (WRITE + f"write(b'x' * {LIMIT})", Outcome.OK, 0, "x" * LIMIT),
    (WRITE + "write(b'a\\r\\nb\\rc\\n\\0\\r\\n')", Outcome.OK, 0, "a\nb\rc\n\0\n"),
    (WRITE + r"write(b'a\xffb\n')", Outcome.ENCODING, 0, "a\\xffb\n"),
    (WRITE + r"write(b'\xed\xa0\x80')", Outcome.ENCODING, 0, "\\xed\\xa0\\x80"),
    (WRITE + r"write(b'a\xc3')", Outcome.ENCODING, 0, "a\\xc3"),
    (WRITE + "write(b'\\xff')\nsys.exit(2)", Outcome.FAILED, 2, "\\xff"),
    ("print('x', flush=True)\nimport os\nos._exit(200)", Outcome.FAILED, 200, "x\n"),
    *((KILL.format("os.getpid()", n), Outcome.KILLED, n, "x\n") for n in (11, 9, 15)),
    (KILL.format("0", 9), Outcome.KILLED, 9, "x\n"),
]


def test_outcome_status_and_output(run: Run) -> None:
    for code, *expected in CASES:
        result = run(code)
        assert [result.outcome, result.status, result.stdout] == expected, code
        assert result.seconds > 0.0 and not result.cached


def test_output_beyond_the_limit_ends_a_script(run: Run) -> None:
    for code in ("write(b'x' * 1048577)", "while True: write(b'\\xc3\\xa9' * 1000)"):
        result = run(WRITE + code)
        assert result.outcome is Outcome.OUTPUT_LIMIT, code
        assert len(result.stdout.encode()) <= LIMIT


def test_end_of_a_long_error_output_is_kept(run: Run) -> None:
    code = "import sys\nfor i in range(60_000): sys.stderr.write(f'é{i:06}\\n')\nprint('done')"
    result = run(code)
    assert (result.outcome, result.stdout) == (Outcome.OK, "done\n")
    assert result.stderr.endswith("é059999\n") and "\\x" not in result.stderr
    assert (1 << 16) - 4 <= len(result.stderr.encode()) <= 1 << 16


def test_crash_says_where_and_leaves_no_core(run: Run, root: Path) -> None:
    code = "import ctypes, resource\nprint(resource.getrlimit(resource.RLIMIT_CORE), flush=True)\n"
    result = run(f"{code}def crash(): ctypes.string_at(0)\ncrash()\n")
    assert (result.outcome, result.status) == (Outcome.KILLED, signal.SIGSEGV)
    assert result.stdout == "(0, 0)\n" and "line 3 in crash" in result.stderr
    assert [path.name for path in root.iterdir()] == ["examples"]


STUBBORN = (
    "def hang(): time.sleep(600)\nhang()",
    "for n in (2, 6, 15): signal.signal(n, signal.SIG_IGN)\nwhile True: pass",
    "os.kill(os.getpid(), signal.SIGSTOP)",
    "os.close(1); os.close(2)\nwhile True: pass",
    "threading.Event().wait()",
    "os.fork()\ntime.sleep(600)",
)


@both_ways
def test_script_that_does_not_end_is_ended_and_says_where(server: ScriptServer, root: Path) -> None:
    head = "import os, signal, threading, time\nprint(1, flush=True)\n"
    first, *rest = run_hanging(server, root, *(head + code for code in STUBBORN))
    assert "line 3 in hang" in first.stderr
    assert [result.stdout for result in (first, *rest)] == ["1\n"] * len(STUBBORN)


def test_script_that_closes_its_output_goes_on(run: Run, root: Path) -> None:
    result = run(
        "import os, time\nprint('x', flush=True)\nos.close(1)\nos.close(2)\n"
        "time.sleep(0.2)\nopen('examples/late', 'w').write('y')\nos._exit(4)\n"
    )
    assert (result.outcome, result.status, result.stdout) == (Outcome.FAILED, 4, "x\n")
    assert (root / "examples/late").exists()


def test_script_that_lacks_a_module_is_skipped(server: ScriptServer, root: Path) -> None:
    (root / "examples/x.py").write_text("print(1)")
    events: list[object] = []
    lacking = ["no_such_module", "json", "json.no_such", "no_such_module.sub"]
    jobs = [job(requires=lacking)]
    (skipped_run,) = server.run(
        root, jobs, parallel=4, on_start=events.append, on_finish=events.append
    )
    assert skipped_run.outcome is Outcome.SKIPPED
    assert skipped_run.missing == ("no_such_module", "json.no_such", "no_such_module.sub")

    assert events == ["examples/x.py", skipped_run]
    assert server.run(root, [], parallel=4) == ()


def test_what_is_required_is_found_and_not_imported(run: Run, root: Path) -> None:
    (root / "examples/package").mkdir()
    for name in ("sibling.py", "package/__init__.py", "package/inner.py"):
        (root / "examples" / name).write_text("raise SystemExit('imported')")
    names = ["numpy", "numpy.linalg", "sibling", "sys", "mjcourse"]
    (root / "examples/package/__init__.py").write_text("")
    result = run("print('ran')", requires=[*names, "package.inner"])
    assert (result.stdout, result.missing) == ("ran\n", ())


def test_script_that_cannot_be_started_says_why(
    run: Run, server: ScriptServer, root: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (root / "examples/folder.py").mkdir()
    (root / "examples/folder.py/__main__.py").write_text("print('must not run')")
    for path in ("examples/none.py", "examples/folder.py"):
        (result,) = server.run(root, [job(path)], parallel=1)
        assert (result.outcome, result.stdout) == (Outcome.FAILED, "")
        assert result.stderr == f"there is no file {path}\n"
    result = run("print(1)", args=["a\0b"])
    assert result.outcome is Outcome.FAILED
    assert result.stderr.startswith("the script cannot be started: ")
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "none"))
    with pytest.raises(EffectError, match="no place for temporary files: no such file"):
        run("print(1)")


def test_what_the_machine_lacks_is_no_mistake_of_a_script(run: Run) -> None:
    """A lack that a script makes for the supervisor, which starts the next one.

    With fewer files than these six it could not even wait for the first script's end.
    """
    limit = "resource.prlimit(os.getppid(), resource.RLIMIT_NOFILE, (6, 6))"
    assert run(f"import os, resource\n{limit}").outcome is Outcome.OK
    with pytest.raises(EffectError, match="too many open files"):
        run("print(1)")


PROBE = program("environment")
"""`test_forked_scripts` compares the rest with what a bare Python finds."""
OUTER = tomllib.loads(fixture_text("scripts/outer_environment.toml"))


@both_ways
def test_script_finds_the_course_and_nothing_of_the_user(
    run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, value in OUTER.items():
        monkeypatch.setenv(name, value)
    pipe = os.pipe()
    for end in pipe:
        os.set_inheritable(end, True)
    result = run(PROBE, args=["a b", "", "*", "é"])
    second_hash = json.loads(run(PROBE).stdout.splitlines()[0])[3]
    for end in pipe:
        os.close(end)
    assert result.outcome is Outcome.OK, result.stderr
    first_line, terminal = result.stdout.splitlines()
    environment, *rest = json.loads(first_line)
    arguments = ["examples/x.py", "a b", "", "*", "é"]
    # 3 is the listing itself.
    assert rest == [arguments, "UTC", second_hash, [], ["0", "1", "2", "3"]]
    assert terminal == "no terminal"
    assert not {"SECRET_TOKEN", "DISPLAY", "COLUMNS", "LC_NUMERIC"} & environment.keys()
    assert environment["MUJOCO_GL"] == "egl"
    assert environment["OMP_NUM_THREADS"] == environment["OPENBLAS_NUM_THREADS"] == "1"
    assert (environment["PYTHONHASHSEED"], environment["NO_COLOR"]) == ("0", "1")
    assert "/outer" not in environment.get("PYTHONPATH", "")
    expected = {*clean_environment(os.environ), "TMPDIR", "PYTHONPATH"}
    assert environment.keys() <= expected | {"LC_CTYPE", "__CF_USER_TEXT_ENCODING"}
    assert not Path(environment["TMPDIR"]).exists()


def test_mjcourse_and_siblings_can_be_imported(run: Run, root: Path) -> None:
    (root / "examples/sibling.py").write_text("value = 42\n")
    (root / "examples/coursebuild.py").write_text("value = 'own'\n")
    result = run(
        "import sibling, mjcourse, coursebuild\n"
        "print(sibling.value, coursebuild.value, mjcourse.__file__, sep='\\n')\n"
    )
    assert result.outcome is Outcome.OK, result.stderr
    *values, library = result.stdout.splitlines()
    assert values == ["42", "own"]
    assert Path(library).parent == SOURCE_TREE / "mjcourse"
    assert not (root / "examples/__pycache__").exists()


def test_temporary_folder_is_removed_whatever_a_script_does_to_it(run: Run, root: Path) -> None:
    locked_folder = "at = tempfile.mkdtemp()\nopen(at + '/f', 'w').close()\nos.chmod(at, 0)\n"
    removed_folder = (
        "os.mkdir('w'); os.chdir('w'); os.rmdir('../w'); shutil.rmtree(os.environ['TMPDIR'])\n"
    )
    for code in (locked_folder, removed_folder):
        result = run(f"import os, shutil, tempfile\n{code}print(os.environ['TMPDIR'], end='')\n")
        assert result.outcome is Outcome.OK, result.stderr
        assert not Path(result.stdout).exists()


@forked_or_not
def test_signals_are_as_at_the_start(root: Path, fork: bool) -> None:
    """A tool that runs under nohup ignores SIGHUP; its scripts must not, nor SIGINT."""
    (root / "examples/x.py").write_text(
        "import signal\nprint([signal.getsignal(n) is not signal.SIG_IGN for n in (1, 2, 15)])"
    )
    code = "import signal\nfor n in (1, 2, 15): signal.signal(n, signal.SIG_IGN)\n" + TOOL
    process = run_code(code, root, fork)
    assert "[True, True, True]" in process.stdout, process.stderr
