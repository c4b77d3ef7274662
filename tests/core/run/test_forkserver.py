"""The process that forks scripts stays warm, is replaced when it must, and keeps scripts apart."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import pytest

from coursebuild.core.model.results import Outcome, ScriptJob, ScriptRun
from coursebuild.core.run.runner import (
    RunEvent,
    RunStarted,
    ScriptServer,
    run_scripts,
)
from support.runners import gone

pytestmark = pytest.mark.site

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

    def test_a_module_beside_the_script_comes_first(
        self, forking: ScriptServer, root: Path
    ) -> None:
        for name in ("random", "numpy", "json"):
            (root / f"examples/{name}.py").write_text("value = 'mine'\n")
        code = "import random, numpy, json\nprint(random.value, numpy.value, json.value)\n"
        job = self.script(root, code)
        other = self.script(root, "import numpy.linalg, json\nprint(json.dumps(1))", "y.py")
        mine, theirs = forking.run(root, [job, other], parallel=1)
        assert (mine.stdout, theirs.stdout) == ("mine mine mine\n", "1\n")

    def test_a_module_on_a_path_that_the_script_adds(
        self, forking: ScriptServer, root: Path
    ) -> None:
        (root / "lib").mkdir()
        (root / "lib/json.py").write_text("value = 'mine'\n")
        job = self.script(
            root, "import sys, numpy\nsys.path.insert(0, 'lib')\nimport json\nprint(json.value)"
        )
        assert forking.run(root, [job], parallel=1)[0].stdout == "mine\n"

    def test_scripts_do_not_share_random_numbers(self, forking: ScriptServer, root: Path) -> None:
        code = "import random, numpy as np, uuid\nprint(random.random())\n"
        code += "print(np.random.rand())\nprint(uuid.uuid4())\n"
        job = self.script(root, code)
        runs = forking.run(root, [job] * 4, parallel=2)
        assert len({line for run in runs for line in run.stdout.splitlines()}) == 12

    def test_scripts_leave_nothing_to_each_other(self, forking: ScriptServer, root: Path) -> None:
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
        runs = forking.run(root, [soil, look, soil, look], parallel=1)
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
                signal.pause()
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
