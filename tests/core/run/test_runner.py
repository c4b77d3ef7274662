"""Running scripts, well-behaved and not."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from coursebuild.core.files.errors import EffectError
from coursebuild.core.model.results import Outcome
from coursebuild.core.run.runner import ScriptServer, clean_environment
from support.runners import SOURCE_TREE, TOOL, Run, both_ways, hangs, job

pytestmark = pytest.mark.site


class TestOutcomes:
    def test_ok(self, run: Run) -> None:
        result = run("import sys\nprint('out')\nprint('err', file=sys.stderr)\n")
        assert (result.outcome, result.status) == (Outcome.OK, 0)
        assert (result.stdout, result.stderr) == ("out\n", "err\n")
        assert result.seconds > 0.0
        assert not result.cached

    @pytest.mark.parametrize(
        ("code", "status", "stderr"),
        [
            ("import sys; sys.exit(3)", 3, ""),
            ("import sys; sys.exit('no')", 1, "no\n"),
            ("import os; os._exit(200)", 200, ""),
            ("raise ValueError('x')", 1, "ValueError: x\n"),
            ("def f(:", 1, "SyntaxError: "),
            ("print('\\udc80')", 1, "UnicodeEncodeError: "),
        ],
    )
    def test_failed(self, run: Run, code: str, status: int, stderr: str) -> None:
        result = run(f"print('before', flush=True)\n{code}\n")
        assert (result.outcome, result.status) == (Outcome.FAILED, status)
        assert stderr in result.stderr
        assert result.stdout in ("before\n", "")

    def test_traceback_names_the_script(self, run: Run, root: Path) -> None:
        result = run("\n\n1 / 0\n")
        assert f'File "{root}/examples/x.py", line 3' in result.stderr

    @pytest.mark.parametrize("number", [signal.SIGSEGV, signal.SIGKILL, signal.SIGTERM])
    def test_killed(self, run: Run, number: signal.Signals) -> None:
        result = run(f"import os\nprint('x', flush=True)\nos.kill(os.getpid(), {int(number)})\n")
        assert (result.outcome, result.status, result.stdout) == (Outcome.KILLED, number, "x\n")

    def test_a_crash_says_where_and_leaves_no_core(self, run: Run, root: Path) -> None:
        result = run("import ctypes\ndef crash(): ctypes.string_at(0)\ncrash()\n")
        assert (result.outcome, result.status) == (Outcome.KILLED, signal.SIGSEGV)
        assert "line 2 in crash" in result.stderr
        limits = run("import resource\nprint(resource.getrlimit(resource.RLIMIT_CORE))")
        assert limits.stdout == "(0, 0)\n"
        assert [path.name for path in root.iterdir()] == ["examples"]

    @both_ways
    def test_timeout_says_where(self, run: Run) -> None:
        code = "import time\nprint('so far', flush=True)\ndef hang(): time.sleep(600)\nhang()\n"
        result = hangs(run, code)
        assert result.stdout == "so far\n"
        assert "line 3 in hang" in result.stderr

    @pytest.mark.parametrize(
        "code",
        [
            "import signal\nfor n in (2, 6, 15): signal.signal(n, signal.SIG_IGN)\n"
            "print(1, flush=True)\nwhile True: pass",
            "import os, signal\nprint(1, flush=True)\nos.kill(os.getpid(), signal.SIGSTOP)",
            "import os\nprint(1, flush=True)\nos.close(1); os.close(2)\nwhile True: pass",
            "import threading\nprint(1, flush=True)\nthreading.Event().wait()",
            "import os, time\nprint(1, flush=True)\nos.fork()\ntime.sleep(600)",
        ],
    )
    def test_timeout_of_the_stubborn(self, run: Run, code: str) -> None:
        assert hangs(run, code).stdout == "1\n"

    def test_skipped_and_norun(self, server: ScriptServer, root: Path) -> None:
        (root / "examples/x.py").write_text("print(1)")
        told: list[object] = []
        jobs = [
            job(requires=["no_such_module", "json", "json.no_such", "no_such_module.sub"]),
            job("examples/none.py", norun=True),
        ]
        skipped, norun = server.run(
            root, jobs, parallel=4, started=told.append, finished=told.append
        )
        assert skipped.outcome is Outcome.SKIPPED
        assert skipped.missing == ("no_such_module", "json.no_such", "no_such_module.sub")
        assert (norun.outcome, norun.stdout) == (Outcome.NORUN, "")
        assert told == ["examples/x.py", skipped]

    def test_what_is_required_is_found_and_not_imported(self, run: Run, root: Path) -> None:
        (root / "examples/sibling.py").write_text("raise SystemExit('imported')")
        (root / "examples/package").mkdir()
        (root / "examples/package/__init__.py").write_text("raise SystemExit('imported')")
        (root / "examples/package/inner.py").touch()
        names = ["numpy", "numpy.linalg", "sibling", "package.inner", "sys", "mjcourse"]
        result = run("print('ran')", requires=names)
        assert (result.stdout, result.missing) == ("ran\n", ())

    def test_vanished_or_a_folder(self, server: ScriptServer, root: Path) -> None:
        (root / "examples/folder.py").mkdir()
        (root / "examples/folder.py/__main__.py").write_text("print('must not run')")
        for path in ("examples/none.py", "examples/folder.py"):
            (result,) = server.run(root, [job(path)], parallel=1)
            assert (result.outcome, result.stdout) == (Outcome.FAILED, "")
            assert result.stderr == f"there is no file {path}\n"

    def test_no_place_for_temporary_files(
        self, run: Run, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
    ) -> None:
        monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "none"))
        with pytest.raises(EffectError, match="no place for temporary files: no such file"):
            run("print(1)")

    def test_impossible_argument(self, run: Run) -> None:
        result = run("print(1)", args=["a\0b"])
        assert result.outcome is Outcome.FAILED
        assert result.stderr.startswith("the script cannot be started: ")


class TestOutput:
    def test_up_to_the_limit(self, run: Run) -> None:
        result = run("import sys\nsys.stdout.write('x' * 1048576)\n")
        assert (result.outcome, len(result.stdout)) == (Outcome.OK, 1 << 20)

    @pytest.mark.parametrize(
        "code",
        [
            "sys.stdout.write('x' * 1048577)",
            "sys.stdout.write('é' * 2_000_000)",
            "while True: print('x' * 1000)",
        ],
    )
    def test_over_the_limit(self, run: Run, code: str) -> None:
        result = run(f"import sys\n{code}\n")
        assert result.outcome is Outcome.OUTPUT_LIMIT
        assert len(result.stdout.encode()) <= 1 << 20

    def test_end_of_a_long_stderr(self, run: Run) -> None:
        code = "import sys\nfor i in range(60_000): sys.stderr.write(f'é{i:06}\\n')\nprint('done')"
        result = run(code)
        assert (result.outcome, result.stdout) == (Outcome.OK, "done\n")
        assert result.stderr.endswith("é059999\n")
        assert "\\x" not in result.stderr
        assert (1 << 16) - 4 <= len(result.stderr.encode()) <= 1 << 16

    @pytest.mark.parametrize(
        ("data", "text"),
        [
            (rb"a\xffb\n", "a\\xffb\n"),
            (rb"\xed\xa0\x80", "\\xed\\xa0\\x80"),
            (rb"a\xc3", "a\\xc3"),
        ],
    )
    def test_not_utf8(self, run: Run, data: bytes, text: str) -> None:
        result = run(b"import sys\nsys.stdout.buffer.write(b'" + data + b"')\n")
        assert (result.outcome, result.status, result.stdout) == (Outcome.ENCODING, 0, text)

    def test_failure_counts_more_than_encoding(self, run: Run) -> None:
        result = run("import sys\nsys.stdout.buffer.write(b'\\xff')\nsys.exit(2)\n")
        assert (result.outcome, result.status) == (Outcome.FAILED, 2)

    def test_line_ends(self, run: Run) -> None:
        result = run("import sys\nsys.stdout.buffer.write(b'a\\r\\nb\\rc\\n\\0\\r\\n')\n")
        assert (result.outcome, result.stdout) == (Outcome.OK, "a\nb\rc\n\0\n")

    def test_closes_its_output_and_goes_on(self, run: Run, root: Path) -> None:
        result = run(
            "import os, time, sys\nprint('x', flush=True)\nos.close(1)\nos.close(2)\n"
            "time.sleep(0.2)\nopen('examples/late', 'w').write('y')\nos._exit(4)\n"
        )
        assert (result.outcome, result.status, result.stdout) == (Outcome.FAILED, 4, "x\n")
        assert (root / "examples/late").exists()

    def test_nothing(self, run: Run) -> None:
        result = run("")
        assert (result.outcome, result.stdout, result.stderr) == (Outcome.OK, "", "")


class TestSurroundings:
    PROBE = (
        "import json, os, sys, time\n"
        "print(json.dumps({'name': __name__, 'file': __file__, 'argv': sys.argv,"
        " 'path': sys.path[0], 'cwd': os.getcwd(), 'env': dict(os.environ),"
        " 'encoding': sys.stdout.encoding, 'zone': time.tzname[0],"
        " 'stdin': sys.stdin.read(), 'hash': hash('a'), 'flags': sys.flags.safe_path,"
        " 'session': os.getsid(0) == os.getpid(), 'tty': [os.isatty(i) for i in range(3)],"
        " 'tmp': os.listdir(os.environ['TMPDIR']), 'warn': sys.warnoptions}))\n"
    )

    @both_ways
    def test_what_a_script_sees(
        self, run: Run, root: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        outer = {
            "PYTHONPATH": "/outer",
            "PYTHONSTARTUP": "/outer",
            "PYTHONWARNINGS": "error",
            "PYTHONSAFEPATH": "1",
            "PYTHONHASHSEED": "7",
            "PYTHONOPTIMIZE": "2",
            "LANG": "de_DE",
            "LC_NUMERIC": "de_DE",
            "TZ": "Asia/Tokyo",
            "COLUMNS": "17",
            "OMP_NUM_THREADS": "64",
            "SECRET_TOKEN": "x",
            "DISPLAY": ":0",
            "MUJOCO_GL": "egl",
        }
        for name, value in outer.items():
            monkeypatch.setenv(name, value)
        result = run(self.PROBE, args=["a b", "", "*", "é"])
        assert result.outcome is Outcome.OK, result.stderr
        seen = json.loads(result.stdout)
        assert seen["name"] == "__main__"
        assert seen["file"] == str(root / "examples/x.py")
        assert seen["argv"] == ["examples/x.py", "a b", "", "*", "é"]
        assert seen["path"] == str(root / "examples")
        assert seen["cwd"] == str(root)
        assert (seen["encoding"], seen["zone"], seen["stdin"]) == ("utf-8", "UTC", "")
        assert seen["session"] is True and seen["tty"] == [False] * 3
        assert seen["tmp"] == [] and seen["warn"] == [] and seen["flags"] is False
        environment = seen["env"]
        assert not {"SECRET_TOKEN", "DISPLAY", "COLUMNS", "LC_NUMERIC"} & environment.keys()
        assert environment["MUJOCO_GL"] == "egl"
        assert environment["OMP_NUM_THREADS"] == environment["OPENBLAS_NUM_THREADS"] == "1"
        assert environment["PYTHONHASHSEED"] == "0"
        assert "/outer" not in environment.get("PYTHONPATH", "")
        assert environment["NO_COLOR"] == "1"
        expected = {*clean_environment(os.environ), "TMPDIR", "PYTHONPATH"}
        assert environment.keys() <= expected | {"LC_CTYPE", "__CF_USER_TEXT_ENCODING"}
        assert not Path(environment["TMPDIR"]).exists()
        again = json.loads(run(self.PROBE).stdout)
        assert again["hash"] == seen["hash"]

    def test_mjcourse_and_siblings_can_be_imported(self, run: Run, root: Path) -> None:
        (root / "examples/sibling.py").write_text("value = 42\n")
        (root / "examples/coursebuild.py").write_text("value = 'own'\n")
        result = run(
            "import sibling, mjcourse, coursebuild\nprint(sibling.value, coursebuild.value)\n"
            "print(mjcourse.__file__)\n"
        )
        assert result.outcome is Outcome.OK, result.stderr
        first, second = result.stdout.splitlines()
        assert first == "42 own"
        assert Path(second).parent == SOURCE_TREE / "mjcourse"
        assert not (root / "examples/__pycache__").exists()

    def test_temporary_folder_goes(self, run: Run, root: Path) -> None:
        result = run(
            "import os, tempfile\nfolder = tempfile.mkdtemp()\nopen(folder + '/f', 'w').close()\n"
            "os.chmod(folder, 0)\nprint(os.path.dirname(folder), end='')\n"
        )
        assert result.outcome is Outcome.OK, result.stderr
        assert not Path(result.stdout).exists()

    def test_deletes_what_it_stands_on(self, run: Run, root: Path) -> None:
        code = "import os, shutil\nos.mkdir('w')\nos.chdir('w')\nos.rmdir('../w')\n"
        result = run(code + "shutil.rmtree(os.environ['TMPDIR'])\nprint('ok')\n")
        assert (result.outcome, result.stdout) == (Outcome.OK, "ok\n")

    def test_has_no_terminal_to_change(self, run: Run) -> None:
        code = "try: open('/dev/tty')\nexcept OSError as e: print('no terminal')\n"
        assert run(code).stdout == "no terminal\n"

    @pytest.mark.parametrize("fork", [True, False], ids=["forked", "spawned"])
    def test_signals_are_as_at_the_start(self, root: Path, fork: bool) -> None:
        """A tool that runs under nohup ignores SIGHUP; its scripts must not, nor SIGINT."""
        (root / "examples/x.py").write_text(
            "import signal\nprint([signal.getsignal(n) is not signal.SIG_IGN for n in (1, 2, 15)])"
        )
        code = "import signal\nfor n in (1, 2, 15): signal.signal(n, signal.SIG_IGN)\n" + TOOL
        done = subprocess.run(
            [sys.executable, "-c", code, root, "1", str(fork)],
            capture_output=True,
            text=True,
            cwd=SOURCE_TREE,
        )
        assert "[True, True, True]" in done.stdout, done.stderr

    def test_files_of_the_tool_are_not_open(self, run: Run) -> None:
        read, write = os.pipe()
        os.set_inheritable(read, True)
        os.set_inheritable(write, True)
        try:
            result = run("import os\nprint(sorted(os.listdir('/proc/self/fd'))[:5])\n")
        finally:
            os.close(read)
            os.close(write)
        assert result.stdout == "['0', '1', '2', '3']\n"  # 3 is the listing itself
