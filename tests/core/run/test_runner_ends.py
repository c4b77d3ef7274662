"""Runs of scripts that end early, and many at once: nothing stays behind."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

import pytest

from coursebuild.core.model.results import Outcome, ScriptRun
from coursebuild.core.run.runner import RunStoppedError, ScriptServer
from support.runners import (
    SOURCE_TREE,
    TOOL,
    Run,
    alive,
    both_ways,
    gone,
    hangs,
    job,
    wait_for,
    wait_until,
)

pytestmark = pytest.mark.site
forked_or_not = pytest.mark.parametrize("fork", [True, False], ids=["forked", "spawned"])

ME = "import os\nopen('examples/me', 'w').write(str(os.getpid()))\n"
DAEMON = """
import os, signal, sys, time
for i in range(3):
    if os.path.exists(f"examples/pid{i}"):
        os.unlink(f"examples/pid{i}")
def daemon(number):
    if os.fork():
        return
    os.setsid()
    if os.fork():
        os._exit(0)
    for n in (1, 2, 15):
        signal.signal(n, signal.SIG_IGN)
    with open(f"examples/pid{number}.part", "w") as file:
        file.write(str(os.getpid()))
    os.rename(f"examples/pid{number}.part", f"examples/pid{number}")
    time.sleep(1000)
    os._exit(0)
for i in range(3):
    daemon(i)
while not all(os.path.exists(f"examples/pid{i}") for i in range(3)):
    time.sleep(0.005)
print("started", flush=True)
"""


class TestNothingStaysBehind:
    def pids(self, root: Path) -> list[int]:
        return [wait_for(root / f"examples/pid{i}") for i in range(3)]

    @both_ways
    @pytest.mark.parametrize("end", ["", "os._exit(0)", "os.abort()"])
    def test_daemons_that_hold_the_pipe(self, run: Run, root: Path, end: str) -> None:
        result = run(f"{DAEMON}\n{end}\n")
        assert result.outcome is (Outcome.KILLED if "abort" in end else Outcome.OK)
        assert result.stdout == "started\n"
        assert not any(alive(pid) for pid in self.pids(root))

    def test_daemons_of_a_script_that_hangs(self, run: Run, root: Path) -> None:
        hangs(run, f"{DAEMON}\ntime.sleep(600)\n")
        assert not any(alive(pid) for pid in self.pids(root))

    def test_a_tree_of_processes(self, run: Run) -> None:
        code = (
            "import os, time\nfor i in range(5): os.fork()\n"
            "print(os.getpid(), flush=True)\ntime.sleep(600)\n"
        )
        result = hangs(run, code, lambda said: said.count("\n") == 32)
        pids = [int(line) for line in result.stdout.split()]
        assert len(pids) == 32
        assert not any(alive(pid) for pid in pids)

    def test_kills_its_own_group(self, run: Run) -> None:
        result = run("import os\nprint('x', flush=True)\nos.kill(0, 9)\n")
        assert (result.outcome, result.status, result.stdout) == (Outcome.KILLED, 9, "x\n")

    @forked_or_not
    def test_kills_its_supervisor(self, root: Path, fork: bool) -> None:
        for name, code in (
            (
                "a",
                f"{ME}import time\nopen('examples/tmp', 'w').write(os.environ['TMPDIR'])\n"
                "os.kill(os.getppid(), 9)\ntime.sleep(60)\n",
            ),
            ("b", "print('b')\n"),
        ):
            (root / f"examples/{name}.py").write_text(code)
        jobs = [job("examples/a.py"), job("examples/b.py"), job("examples/b.py")]
        with ScriptServer(fork=fork) as server:
            a, *others = server.run(root, jobs, parallel=1)
        assert (a.outcome, a.status) == (Outcome.KILLED, 9)
        assert "the process that supervises this script was ended by SIGKILL" in a.stderr
        assert [r.stdout for r in others] == ["b\n", "b\n"]
        assert gone(wait_for(root / "examples/me"))
        assert not Path((root / "examples/tmp").read_text()).parent.exists()

    def tool(self, root: Path, code: str, fork: bool) -> subprocess.Popen[str]:
        (root / "examples/x.py").write_text(code)
        return subprocess.Popen(
            [sys.executable, "-c", TOOL, root, "1", str(fork)],
            stdout=subprocess.PIPE,
            text=True,
            cwd=SOURCE_TREE,
        )

    @pytest.mark.parametrize(
        ("number", "fork"),
        [
            (signal.SIGKILL, True),
            (signal.SIGTERM, True),
            (signal.SIGINT, True),
            (signal.SIGKILL, False),
        ],
    )
    def test_the_tool_is_killed(self, root: Path, number: signal.Signals, fork: bool) -> None:
        code = f"{DAEMON}\nopen('examples/tmp', 'w').write(os.environ['TMPDIR'])\n"
        code += "open('examples/me', 'w').write(str(os.getpid()))\ntime.sleep(100)\n"
        with self.tool(root, code, fork) as tool:
            script = wait_for(root / "examples/me")
            tool.send_signal(number)
            said, _ = tool.communicate()
        assert said == ("interrupted\n" if number is signal.SIGINT else "")
        pids = [script, *self.pids(root)]
        if number is signal.SIGINT:  # it had the time to see to it
            assert not any(alive(pid) for pid in pids)
        assert all(gone(pid) for pid in pids)
        folder = Path((root / "examples/tmp").read_text())
        assert folder.parent.name.startswith("coursebuild-")
        wait_until(lambda: not folder.parent.exists(), "the end of the temporary folder")

    def test_whoever_asked_wants_them_no_more(self, root: Path) -> None:
        (root / "examples/x.py").write_text(
            "import os, time\nopen('examples/me', 'w').write(str(os.getpid()))\ntime.sleep(60)\n"
        )
        (root / "examples/y.py").write_text("print('y')\n")
        asked: list[frozenset[str]] = []

        def unwanted(running: frozenset[str]) -> bool:
            asked.append(running)
            return (root / "examples/me").exists() and running == {"examples/x.py"}

        jobs = [job("examples/x.py"), job("examples/y.py")]
        with ScriptServer() as server:
            with pytest.raises(RunStoppedError):
                server.run(root, jobs, parallel=2, unwanted=unwanted)
            assert frozenset({"examples/x.py"}) in asked
            assert gone(wait_for(root / "examples/me"))
            (after,) = server.run(root, jobs[1:], parallel=2, unwanted=lambda running: False)
            assert after.stdout == "y\n"

    def test_whoever_listens_fails(self, server: ScriptServer, root: Path) -> None:
        (root / "examples/x.py").write_text(
            "import os, time\nopen('examples/me', 'w').write(str(os.getpid()))\ntime.sleep(60)\n"
        )
        (root / "examples/y.py").write_text(
            "import os, time\nwhile not os.path.exists('examples/me'): time.sleep(0.01)\n"
        )

        def listen(run: ScriptRun) -> None:
            raise RuntimeError("listener")

        with pytest.raises(RuntimeError, match="listener"):
            server.run(root, [job(), job("examples/y.py")], parallel=2, finished=listen)
        assert not alive(wait_for(root / "examples/me"))


class TestMany:
    def test_results_come_in_order_and_events_tell(self, server: ScriptServer, root: Path) -> None:
        """The first script is the last to end: it waits for what the last one writes."""
        (root / "examples/0.py").write_text(
            "import os, time\nwhile not os.path.exists('examples/met'): time.sleep(0.001)\nprint(0)"
        )
        for i in (1, 2):
            (root / f"examples/{i}.py").write_text(f"print({i})")
        (root / "examples/3.py").write_text("print(3)\nopen('examples/met', 'w').close()")
        started: list[str] = []
        finished: list[ScriptRun] = []
        jobs = [job(f"examples/{i}.py") for i in range(4)]
        runs = server.run(root, jobs, parallel=2, started=started.append, finished=finished.append)
        assert [r.stdout for r in runs] == ["0\n", "1\n", "2\n", "3\n"]
        assert started == [j.path for j in jobs]
        assert sorted(finished, key=lambda r: r.path) == list(runs)

    @pytest.mark.parametrize("parallel", [1, 3])
    def test_so_many_at_a_time_and_no_more(
        self, server: ScriptServer, root: Path, parallel: int
    ) -> None:
        """Each script waits for as many as may run at a time to have begun."""
        code = (
            "import os, sys, time\nopen(f'examples/run{os.getpid()}', 'w').close()\n"
            "def runs(): return len([n for n in os.listdir('examples') if n.startswith('run')])\n"
            "while runs() < int(sys.argv[1]): time.sleep(0.001)\n"
        )
        (root / "examples/x.py").write_text(code)
        running = [0]

        jobs = [job(args=[str(parallel)])] * 6
        runs = server.run(
            root,
            jobs,
            parallel=parallel,
            started=lambda path: running.append(running[-1] + 1),
            finished=lambda run: running.append(running[-1] - 1),
        )
        assert {run.outcome for run in runs} == {Outcome.OK}
        assert max(running) == parallel

    def test_nothing_to_do(self, server: ScriptServer, root: Path) -> None:
        assert server.run(root, [], parallel=4) == ()
        assert server.run(root, [job(norun=True)] * 2, parallel=4)[1].outcome is Outcome.NORUN
