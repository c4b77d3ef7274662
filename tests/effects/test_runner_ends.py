"""Runs of scripts that end early, and many at once: nothing stays behind."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from coursebuild.effects.runner import (
    RunEvent,
    RunFinished,
    RunStarted,
    RunStoppedError,
    ScriptServer,
)
from coursebuild.results import Outcome
from support.runners import SOURCE_TREE, TOOL, Run, alive, gone, job, run_scripts, wait_for, way

pytestmark = pytest.mark.usefixtures("both_ways")


ME = "import os\nopen('examples/me', 'w').write(str(os.getpid()))\n"
DAEMON = """
import os, signal, sys, time
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

    @pytest.mark.parametrize("end", ["", "os._exit(0)", "os.abort()"])
    def test_daemons_that_hold_the_pipe(self, run: Run, root: Path, end: str) -> None:
        start = time.monotonic()
        result = run(f"{DAEMON}\n{end}\n", timeout=600.0)
        assert time.monotonic() - start < 300.0
        assert result.stdout == "started\n"
        assert not any(alive(pid) for pid in self.pids(root))

    def test_daemons_of_a_script_that_hangs(self, run: Run, root: Path) -> None:
        result = run(f"{DAEMON}\ntime.sleep(600)\n", timeout=10.0)
        assert result.outcome is Outcome.TIMEOUT
        assert not any(alive(pid) for pid in self.pids(root))

    def test_a_tree_of_processes(self, run: Run) -> None:
        code = (
            "import os, time\nfor i in range(5): os.fork()\n"
            "print(os.getpid(), flush=True)\ntime.sleep(600)\n"
        )
        result = run(code, timeout=10.0)
        assert result.outcome is Outcome.TIMEOUT
        pids = [int(line) for line in result.stdout.split()]
        assert len(pids) == 32
        assert not any(alive(pid) for pid in pids)

    def test_kills_its_own_group(self, run: Run) -> None:
        result = run("import os\nprint('x', flush=True)\nos.kill(0, 9)\n")
        assert (result.outcome, result.status, result.stdout) == (Outcome.KILLED, 9, "x\n")

    def test_kills_its_supervisor(self, root: Path) -> None:
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
        a, *others = run_scripts(root, jobs, parallel=1)
        assert (a.outcome, a.status) == (Outcome.KILLED, 9)
        assert "the process that supervises this script was ended by SIGKILL" in a.stderr
        assert [r.stdout for r in others] == ["b\n", "b\n"]
        assert gone(wait_for(root / "examples/me"))
        assert not Path((root / "examples/tmp").read_text()).parent.exists()

    def tool(self, root: Path, code: str) -> subprocess.Popen[str]:
        (root / "examples/x.py").write_text(code)
        return subprocess.Popen(
            [sys.executable, "-c", TOOL, root, "1", str(way["fork"])],
            stdout=subprocess.PIPE,
            text=True,
            cwd=SOURCE_TREE,
        )

    @pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM, signal.SIGINT])
    def test_the_tool_is_killed(self, root: Path, number: signal.Signals) -> None:
        code = f"{DAEMON}\nopen('examples/tmp', 'w').write(os.environ['TMPDIR'])\n"
        code += "open('examples/me', 'w').write(str(os.getpid()))\ntime.sleep(100)\n"
        with self.tool(root, code) as tool:
            script = wait_for(root / "examples/me")
            tool.send_signal(number)
            said, _ = tool.communicate(timeout=120)
        assert said == ("interrupted\n" if number is signal.SIGINT else "")
        pids = [script, *self.pids(root)]
        if number is signal.SIGINT:  # it had the time to see to it
            assert not any(alive(pid) for pid in pids)
        assert all(gone(pid) for pid in pids)
        folder = Path((root / "examples/tmp").read_text())
        until = time.monotonic() + 120
        while folder.parent.exists() and time.monotonic() < until:
            time.sleep(0.01)
        assert folder.parent.name.startswith("coursebuild-") and not folder.parent.exists()

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
        with ScriptServer(**way) as server:
            with pytest.raises(RunStoppedError):
                server.run(root, jobs, parallel=2, unwanted=unwanted)
            assert frozenset({"examples/x.py"}) in asked
            assert gone(wait_for(root / "examples/me"))
            (after,) = server.run(root, jobs[1:], parallel=2, unwanted=lambda running: False)
            assert after.stdout == "y\n"

    def test_whoever_listens_fails(self, root: Path) -> None:
        (root / "examples/x.py").write_text(
            "import os, time\nopen('examples/me', 'w').write(str(os.getpid()))\ntime.sleep(60)\n"
        )
        (root / "examples/y.py").write_text(
            "import os, time\nwhile not os.path.exists('examples/me'): time.sleep(0.01)\n"
        )

        def listen(event: RunEvent) -> None:
            if isinstance(event, RunFinished):
                raise RuntimeError("listener")

        with pytest.raises(RuntimeError, match="listener"):
            run_scripts(root, [job(), job("examples/y.py")], parallel=2, on_event=listen)
        assert not alive(wait_for(root / "examples/me"))


class TestMany:
    def test_results_come_in_order_and_events_tell(self, root: Path) -> None:
        for i, seconds in enumerate((0.3, 0.0, 0.1, 0.0)):
            (root / f"examples/{i}.py").write_text(
                f"import time\ntime.sleep({seconds})\nprint({i})"
            )
        events: list[RunEvent] = []
        jobs = [job(f"examples/{i}.py") for i in range(4)]
        runs = run_scripts(root, jobs, parallel=2, on_event=events.append)
        assert [r.stdout for r in runs] == ["0\n", "1\n", "2\n", "3\n"]
        started = [e.path for e in events if isinstance(e, RunStarted)]
        finished = [e.run for e in events if isinstance(e, RunFinished)]
        assert started == [j.path for j in jobs]
        assert sorted(finished, key=lambda r: r.path) == list(runs)
        assert [e.done for e in events if isinstance(e, RunFinished)] == [1, 2, 3, 4]
        assert {e.total for e in events} == {4}

    def test_at_most_so_many_at_a_time(self, root: Path) -> None:
        """The first that is not alone lets all others go, so that none waits for one to come."""
        code = (
            "import os, sys, time\nname = f'examples/run{os.getpid()}'\nopen(name, 'w').close()\n"
            "def runs(): return len([n for n in os.listdir('examples') if n.startswith('run')])\n"
            "while sys.argv[1] != '1' and not os.path.exists('examples/met'):\n"
            "    if runs() > 1: open('examples/met', 'w').close()\n"
            "    time.sleep(0.001)\n"
            "print(runs())\ntime.sleep(0.05)\nos.unlink(name)\n"
        )
        (root / "examples/x.py").write_text(code)
        for parallel in (1, 3):
            jobs = [job(args=[str(parallel)], timeout=300.0)] * 6
            counts = [int(run.stdout) for run in run_scripts(root, jobs, parallel=parallel)]
            assert max(counts) <= parallel
        assert (root / "examples/met").exists()

    def test_nothing_to_do(self, root: Path) -> None:
        assert run_scripts(root, [], parallel=4) == ()
        assert run_scripts(root, [job(norun=True)] * 2, parallel=4)[1].outcome is Outcome.NORUN

    def test_supervisors_serve_many(self, root: Path) -> None:
        (root / "examples/x.py").write_text("import os\nprint(os.getppid())")
        runs = run_scripts(root, [job()] * 8, parallel=2)
        assert len({r.stdout for r in runs}) == 2
