"""Supervisors stay warm, are replaced when they must, and keep scripts apart."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import pytest

from coursebuild.core.model.results import Outcome, ScriptJob, ScriptRun
from coursebuild.core.run.runner import ScriptServer
from support.runners import gone

pytestmark = pytest.mark.site

WHO = "import os\nprint(os.getppid())\n"


def supervisor_of(run: ScriptRun) -> int:
    assert run.outcome is Outcome.OK, run.stderr
    return int(run.stdout)


class TestServer:
    def script(self, root: Path, code: str, name: str = "examples/x.py") -> ScriptJob:
        (root / name).write_text(code)
        return ScriptJob(name, (), 120.0, (), False)

    def test_it_stays(self, root: Path) -> None:
        job = self.script(root, "import numpy\n" + WHO)
        with ScriptServer() as server:
            runs = [server.run(root, [job] * 3, parallel=2) for _ in range(3)]
        assert len({supervisor_of(run) for several in runs for run in several}) == 2

    @pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM, signal.SIGSEGV])
    def test_it_dies_between_two_runs(self, root: Path, number: signal.Signals) -> None:
        job = self.script(root, WHO)
        with ScriptServer() as server:
            first = supervisor_of(server.run(root, [job], parallel=1)[0])
            os.kill(first, number)
            assert gone(first)
            second = supervisor_of(server.run(root, [job], parallel=1)[0])
        assert first != second

    def test_it_sees_another_environment(self, root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        job = self.script(root, "import os\nprint(os.environ.get('MUJOCO_GL'))")
        with ScriptServer() as server:
            for value in ("egl", "osmesa"):
                monkeypatch.setenv("MUJOCO_GL", value)
                assert server.run(root, [job], parallel=1)[0].stdout == f"{value}\n"

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
