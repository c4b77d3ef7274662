"""A script in a forked process is none the wiser; and the process that forks it stays warm."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import tempfile
import textwrap
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from coursebuild.effects import workers
from coursebuild.effects.runner import (
    RunEvent,
    RunStarted,
    ScriptServer,
    clean_environment,
    run_scripts,
)
from coursebuild.effects.surroundings import library_folder, wanted_packages
from coursebuild.results import Outcome, ScriptJob, ScriptRun
from support.probe_scripts import FAILURES, PROBES
from support.runners import gone

WARM = str(workers._WARM)
ARGUMENTS = ("a b", "", "*", "é", "--flag=1", "\udc80")


@pytest.fixture(scope="module")
def server() -> Iterator[ScriptServer]:
    with ScriptServer() as server:
        yield server


@pytest.fixture
def root(tmp_path: Path) -> Path:
    (tmp_path / "examples").mkdir()
    return tmp_path.resolve()


def bare(root: Path, path: str) -> tuple[str, str, int]:
    """What Python itself makes of a script."""
    # As short as the runner's own: the path of a socket in it must not have many characters.
    with tempfile.TemporaryDirectory(prefix="bare-", dir="/tmp") as temporary:
        return _bare(root, path, temporary)


def _bare(root: Path, path: str, temporary: str) -> tuple[str, str, int]:
    environment = clean_environment(os.environ) | {"TMPDIR": temporary}
    if subprocess.run(
        [sys.executable, "-P", "-c", "import mjcourse"], capture_output=True, cwd="/"
    ).returncode:
        environment["PYTHONPATH"] = library_folder()
    done = subprocess.run(
        [sys.executable, path, *ARGUMENTS],
        cwd=root,
        env=environment,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        start_new_session=True,
        timeout=300,
    )
    texts = (
        data.decode("utf-8", "backslashreplace").replace("\r\n", "\n")
        for data in (done.stdout, done.stderr)
    )
    out, err = texts
    return plain(out), plain(err), done.returncode


def plain(text: str) -> str:
    """Without what differs between any two runs."""
    return re.sub(r"0x[0-9a-f]{6,}", "0x…", re.sub(r"\b\d{15}\b", "…", text))


def seen(run: ScriptRun) -> tuple[str, str, int]:
    status = -run.status if run.outcome is Outcome.KILLED else run.status
    return plain(run.stdout), plain(run.stderr), status


def jobs(*paths: str) -> list[ScriptJob]:
    return [ScriptJob(path, ARGUMENTS, 300.0, (), False) for path in paths]


CASES = PROBES | {
    f"{name} {i}": code for name, codes in FAILURES.items() for i, code in enumerate(codes)
}


@pytest.mark.parametrize("name", CASES)
def test_a_forked_script_does_what_a_bare_one_does(
    name: str, root: Path, server: ScriptServer
) -> None:
    code = CASES[name]
    if name in PROBES:
        code = textwrap.dedent(code)
    encoding = "latin-1" if "latin-1" in code else "utf-8"
    (root / "examples/probe.py").write_bytes(code.encode(encoding, "surrogatepass"))
    (warm,) = server.run(root, [*jobs("examples/probe.py")], parallel=1)
    expected = bare(root, "examples/probe.py")
    assert seen(warm) == expected
    (cold,) = run_scripts(root, jobs("examples/probe.py"), parallel=1, fork=False)
    assert seen(cold) == expected


WHO = "import os\nprint(os.getppid(), open(f'/proc/{os.getppid()}/stat').read().split()[3])\n"


def server_of(run: ScriptRun) -> int:
    assert run.outcome is Outcome.OK, run.stderr
    return int(run.stdout.split()[1])


class TestServer:
    def script(self, root: Path, code: str, name: str = "examples/x.py") -> ScriptJob:
        (root / name).write_text(code)
        return ScriptJob(name, (), 120.0, (), False)

    def test_it_stays(self, root: Path) -> None:
        job = self.script(root, "import numpy\n" + WHO)
        with ScriptServer() as server:
            runs = [server.run(root, [job] * 3, parallel=2) for _ in range(3)]
        assert len({server_of(run) for several in runs for run in several}) == 1

    @pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM, signal.SIGSEGV])
    def test_it_dies_between_two_runs(self, root: Path, number: signal.Signals) -> None:
        job = self.script(root, WHO)
        with ScriptServer() as server:
            first = server_of(server.run(root, [job], parallel=1)[0])
            os.kill(first, number)
            assert gone(first)
            second = server_of(server.run(root, [job], parallel=1)[0])
        assert first != second

    def test_a_script_ends_it(self, root: Path) -> None:
        code = "import os, time\npid = int(open(f'/proc/{os.getppid()}/stat').read().split()[3])\n"
        job = self.script(root, f"{code}os.kill(pid, 9)\ntime.sleep(100)\n", "examples/bad.py")
        good = self.script(root, WHO)
        with ScriptServer() as server:
            runs = server.run(root, [job, good, good], parallel=1)
            again = server.run(root, [good], parallel=1)
        assert (runs[0].outcome, runs[0].status) == (Outcome.KILLED, 9)
        assert "the process that supervises this script was ended by SIGKILL" in runs[0].stderr
        assert server_of(runs[1]) == server_of(runs[2]) == server_of(again[0])

    def test_it_sees_another_environment(self, root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        job = self.script(root, "import os\nprint(os.environ.get('MUJOCO_GL'))")
        with ScriptServer() as server:
            for value in ("egl", "osmesa"):
                monkeypatch.setenv("MUJOCO_GL", value)
                assert server.run(root, [job], parallel=1)[0].stdout == f"{value}\n"

    def test_another_version_is_installed(self, root: Path, tmp_path: Path) -> None:
        """The package stands in for NumPy: a folder on a path that an interpreter starts with."""
        job = self.script(root, "import numpy\n" + WHO)
        with ScriptServer() as server:
            first = server_of(server.run(root, [job], parallel=1)[0])
            assert server.run(root, [job], parallel=1)[0].stdout.split()[1] == str(first)
            assert server._server is not None
            stamps = server._server._stamps
            assert any(path.endswith("/numpy/__init__.py") for path in stamps)
            path = next(path for path in stamps if path.endswith("/numpy/__init__.py"))
            stamps[path] = (0, 0, 0)
            assert server_of(server.run(root, [job], parallel=1)[0]) != first

    def test_more_is_imported_when_it_is_asked_for(self, root: Path) -> None:
        probe = "print(bool(re.search(r'libmujoco|_multiarray', open('/proc/self/maps').read())))"
        plain = self.script(root, f"import re\n{probe}\n{WHO}", "examples/plain.py")
        asks = self.script(root, f"import mujoco\n{WHO}", "examples/asks.py")
        with ScriptServer() as server:
            first = server.run(root, [plain], parallel=1)[0].stdout.split()
            second = server.run(root, [asks], parallel=1)[0].stdout.split()
            third = server.run(root, [plain], parallel=1)[0].stdout.split()
        assert (first[0], third[0]) == ("False", "True")
        assert first[2] == second[1] == third[2]

    def test_a_module_beside_the_script_comes_first(self, root: Path) -> None:
        for name in ("random", "numpy", "json"):
            (root / f"examples/{name}.py").write_text("value = 'mine'\n")
        code = "import random, numpy, json\nprint(random.value, numpy.value, json.value)\n"
        job = self.script(root, code)
        other = self.script(root, "import numpy.linalg, json\nprint(json.dumps(1))", "y.py")
        with ScriptServer() as server:
            mine, theirs = server.run(root, [job, other], parallel=1)
        assert (mine.stdout, theirs.stdout) == ("mine mine mine\n", "1\n")

    def test_a_module_on_a_path_that_the_script_adds(self, root: Path) -> None:
        (root / "lib").mkdir()
        (root / "lib/json.py").write_text("value = 'mine'\n")
        job = self.script(
            root, "import sys, numpy\nsys.path.insert(0, 'lib')\nimport json\nprint(json.value)"
        )
        with ScriptServer() as server:
            assert server.run(root, [job], parallel=1)[0].stdout == "mine\n"

    def test_scripts_do_not_share_random_numbers(self, root: Path) -> None:
        code = "import random, numpy as np, uuid\nprint(random.random())\n"
        code += "print(np.random.rand())\nprint(uuid.uuid4())\n"
        job = self.script(root, code)
        with ScriptServer() as server:
            runs = server.run(root, [job] * 4, parallel=2)
        assert len({line for run in runs for line in run.stdout.splitlines()}) == 12

    def test_scripts_leave_nothing_to_each_other(self, root: Path) -> None:
        soil = self.script(
            root,
            "import numpy as np, os, sys, warnings, gc, signal\nnp.set_printoptions(precision=1)\n"
            "np.seterr(all='raise')\nos.environ['X'] = '1'\nsys.path.append('x')\n"
            "warnings.simplefilter('error')\ngc.disable()\nnp.pi = 3\nos.umask(0)\n"
            "signal.signal(15, signal.SIG_IGN)\nsys.setrecursionlimit(50)\n",
            "examples/soil.py",
        )
        look = self.script(
            root,
            "import numpy as np, os, sys, gc, signal\nprint(np.pi, np.geterr()['divide'], "
            "os.environ.get('X'), 'x' in sys.path, gc.isenabled(), os.umask(0) != 0, "
            "signal.getsignal(15) == signal.SIG_DFL, sys.getrecursionlimit(), np.array(2 / 3))",
        )
        with ScriptServer() as server:
            runs = server.run(root, [soil, look, soil, look], parallel=1)
        expected = "3.141592653589793 warn None False True True True 1000 0.6666666666666666\n"
        assert [run.stdout for run in runs] == ["", expected] * 2

    def test_what_is_expected_is_imported_meanwhile(self, root: Path) -> None:
        job = self.script(root, "import mujoco, time\nprint(mujoco.mj_version() > 0)")
        other = self.script(root, "import numpy\nprint(numpy.pi > 3)", "examples/y.py")
        with ScriptServer() as server:
            server.expect(["mujoco"])
            server.expect(["numpy"])
            runs = server.run(root, [other, job], parallel=2)
            server.expect(["mujoco", "not_installed"])
            runs += server.run(root, [other], parallel=2)
        assert [run.stdout for run in runs] == ["True\n"] * 3

    def test_it_ends_though_a_copy_of_the_tool_goes_on(self, root: Path) -> None:
        job = self.script(root, "print(1)")
        with ScriptServer() as server:
            server.expect(())
            copy = os.fork()
            if not copy:
                time.sleep(600)
                os._exit(0)
            try:
                assert server.run(root, [job], parallel=1)[0].stdout == "1\n"
                assert server._server is not None
                process = server._server._process
                server.close()
                assert process.returncode == 0, "it ended by itself, and was not killed"
            finally:
                os.kill(copy, signal.SIGKILL)
                os.waitpid(copy, 0)

    def test_order(self, root: Path) -> None:
        jobs = [self.script(root, f"print({i})", f"examples/{i}.py") for i in range(4)]
        started: list[str] = []

        def listen(event: RunEvent) -> None:
            if isinstance(event, RunStarted):
                started.append(event.path)

        order = [2, 0, 3, 1]
        runs = run_scripts(root, jobs, parallel=1, order=order, on_event=listen)
        assert started == [jobs[i].path for i in order]
        assert [run.stdout for run in runs] == ["0\n", "1\n", "2\n", "3\n"]

    def test_where_forking_cannot_be_scripts_are_started(
        self, root: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
    ) -> None:
        """A package that starts a thread, prints, fails or crashes when it is imported."""
        job = self.script(root, "print('ran')")
        for body in (
            "import threading, time\nthreading.Thread(target=time.sleep, args=(9,)).start()",
            "print('hello')",
            "import os\nos.environ['X'] = '1'",
            "1 / 0",
            "import os\nos.abort()",
            "raise SystemExit",
            "import signal\nsignal.signal(15, signal.SIG_IGN)",
            "import os\nos.open('/dev/null', 0)",
        ):
            module = tmp_path / "standin.py"
            module.write_text(body)
            monkeypatch.setattr(
                "coursebuild.effects.runner.wanted_packages", lambda scripts: ("standin",)
            )
            monkeypatch.setattr("coursebuild.effects.workers._WARM", f"{WARM}:{tmp_path}")
            with ScriptServer() as server:
                (run,) = server.run(root, [job], parallel=1)
                assert (run.outcome, run.stdout) == (Outcome.OK, "ran\n"), body
                assert server._server is None or server._server.trouble, body

    def test_what_is_not_installed_is_no_trouble(
        self, root: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(
            "coursebuild.effects.runner.wanted_packages", lambda scripts: ("no_such_package",)
        )
        with ScriptServer() as server:
            assert server.run(root, [self.script(root, WHO)], parallel=1)[0].outcome is Outcome.OK
            assert server._server is not None and not server._server.trouble


RUN_BOTH_WAYS = """
import sys
from pathlib import Path
from coursebuild.effects.runner import ScriptServer
from coursebuild.results import ScriptJob
for fork in (True, False):
    with ScriptServer(fork=fork) as server:
        (run,) = server.run(Path(sys.argv[1]), [ScriptJob("x.py", (), 30.0, (), False)], parallel=1)
    print(run.outcome.name, repr(run.stdout), repr(run.stderr), run.trace.modules)
"""


@pytest.mark.parametrize(
    "code",
    [
        "import sys, json\nsys.marked = json.dumps(1)",
        "import no_such_module",
        "import sys\nsys.modules.pop('sitecustomize')",
        "1 / 0",
        "print('said', flush=True)",
        None,
    ],
)
def test_an_installation_with_its_own_start(tmp_path: Path, code: str | None) -> None:
    venv = tmp_path / "venv"
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", venv], check=True)
    if code is not None:
        (folder,) = venv.glob("lib/python*/site-packages")
        (folder / "sitecustomize.py").write_text(code)
    (tmp_path / "x.py").write_text(
        "import sys\nprint(getattr(sys, 'marked', None), 'sitecustomize' in sys.modules)"
    )
    done = subprocess.run(
        [venv / "bin/python", "-c", RUN_BOTH_WAYS, tmp_path],
        cwd=library_folder(),
        capture_output=True,
        text=True,
    )
    bare = subprocess.run(
        [venv / "bin/python", "x.py"],
        cwd=tmp_path,
        env=clean_environment(os.environ),
        capture_output=True,
        text=True,
    )
    expected = f"OK {bare.stdout!r} {bare.stderr!r} ()"
    assert done.stdout.splitlines()[-2:] == [expected] * 2, done.stderr


@pytest.mark.parametrize(
    ("code", "wanted"),
    [
        ("", ()),
        ("import numpy as np", ("numpy",)),
        ("from numpy.linalg import inv", ("numpy",)),
        ("import numpy as np\nnp.random.rand()", ("numpy", "numpy.random")),
        ("from numpy.random import default_rng", ("numpy", "numpy.random")),
        ("if x:\n    import os, mujoco as m", ("numpy", "mujoco")),
        ("import mjcourse", ("numpy",)),
        ("import beside", ("numpy", "mujoco")),
        ("import numpydoc, mujocox", ()),
        ('"""\nimport mujoco\n"""', ()),
        ("# import mujoco\nx = 'import numpy'", ()),
        ("import mujoco\ndef f(:", ()),
        ("import mujoco\0", ()),
    ],
)
def test_wanted_packages(tmp_path: Path, code: str, wanted: tuple[str, ...]) -> None:
    (tmp_path / "beside.py").write_text("import x, mujoco\n")
    (tmp_path / "x.py").write_text(code)
    assert wanted_packages([tmp_path / "none.py", tmp_path / "x.py"]) == wanted
