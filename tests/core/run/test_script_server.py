"""Supervisors stay warm, are replaced when they must, and keep scripts apart."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import pytest

from coursebuild.core.model.results import Outcome, ScriptRun
from coursebuild.core.run.script_server import ScriptServer
from support.runners import Run, job, wait_until_ended

pytestmark = pytest.mark.site


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
    (root / "examples/soil.py").write_text(
        "import numpy as np, os, sys, warnings, gc, signal\nnp.set_printoptions(precision=1)\n"
        "np.seterr(all='raise')\nos.environ['X'] = '1'\nsys.path.append('x')\n"
        "warnings.simplefilter('error')\ngc.disable()\nnp.pi = 3\nos.umask(0)\n"
        "signal.signal(15, signal.SIG_IGN)\nsys.setrecursionlimit(50)\n"
    )
    (root / "examples/look.py").write_text(
        "import numpy as np, os, sys, gc, signal\nprint(np.pi, np.geterr()['divide'], "
        "os.environ.get('X'), 'x' in sys.path, gc.isenabled(), os.umask(0) != 0, "
        "signal.getsignal(15) == signal.SIG_DFL, sys.getrecursionlimit(), np.array(2 / 3))",
    )
    jobs = [job("examples/soil.py"), job("examples/look.py")]
    expected = "3.141592653589793 warn None False True True True 1000 0.6666666666666666\n"
    assert [run.stdout for run in server.run(root, jobs * 2, parallel=1)] == ["", expected] * 2
