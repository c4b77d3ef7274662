"""Runs of scripts that end early, and many at once: nothing stays behind."""

from __future__ import annotations

import itertools
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from coursebuild.core.model.results import Outcome, ScriptRun
from coursebuild.core.run.script_server import RunStoppedError, ScriptServer
from support.fixture_cases import fixture_text
from support.runners import (
    SOURCE_TREE,
    TOOL,
    Run,
    both_ways,
    forked_or_not,
    is_alive,
    job,
    run_hanging,
    wait_for,
    wait_until_ended,
)
from support.waiting import wait_until

pytestmark = pytest.mark.site

RECORD_PID = (
    "import os, time\nopen('examples/tmp', 'w').write(os.environ['TMPDIR'])\n"
    "open('examples/me', 'w').write(str(os.getpid()))\n"
)
DAEMON = fixture_text("scripts/daemon.txt")


def daemons(root: Path) -> list[int]:
    return [wait_for(root / f"examples/pid{i}") for i in range(3)]


@both_ways
def test_daemons_that_hold_the_pipe_end_with_their_script(run: Run, root: Path) -> None:
    for end, outcome in (("", Outcome.OK), ("os._exit(0)", Outcome.OK), ("os.abort()", None)):
        result = run(f"{DAEMON}\n{end}\n")
        assert result.outcome is (outcome or Outcome.KILLED)
        assert result.stdout == "started\n"
        assert not any(is_alive(pid) for pid in daemons(root)), end


def test_all_that_a_hanging_script_has_started_ends(server: ScriptServer, root: Path) -> None:
    run_hanging(server, root, f"{DAEMON}\ntime.sleep(600)\n")
    assert not any(is_alive(pid) for pid in daemons(root))
    code = "import os, time\nfor i in range(5): os.fork()\nprint(os.getpid(), flush=True)\n"
    code += "time.sleep(600)\n"
    (result,) = run_hanging(server, root, code, is_done=lambda output: output.count("\n") == 32)
    assert len(result.stdout.split()) == 32
    assert not any(is_alive(int(pid)) for pid in result.stdout.split())


@forked_or_not
def test_script_that_kills_its_supervisor(root: Path, fork: bool) -> None:
    (root / "examples/a.py").write_text(f"{RECORD_PID}os.kill(os.getppid(), 9)\ntime.sleep(60)\n")
    (root / "examples/b.py").write_text("print('b')\n")
    jobs = [job("examples/a.py"), job("examples/b.py"), job("examples/b.py")]
    with ScriptServer(fork=fork) as server:
        a, *later_runs = server.run(root, jobs, parallel=1)
    assert (a.outcome, a.status) == (Outcome.KILLED, 9)
    assert a.stderr == "the process that supervises this script was killed by SIGKILL\n"
    assert [r.stdout for r in later_runs] == ["b\n", "b\n"]
    assert wait_until_ended(wait_for(root / "examples/me"))
    assert not Path((root / "examples/tmp").read_text()).parent.exists()


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM, signal.SIGINT, 0])
def test_nothing_survives_the_tool(root: Path, number: int) -> None:
    """Each signal ends the tool; 0 stands for SIGKILL with spawned scripts."""
    fork, number = bool(number), number or signal.SIGKILL
    (root / "examples/x.py").write_text(f"{DAEMON}\n{RECORD_PID}time.sleep(100)\n")
    command = [sys.executable, "-c", TOOL, root, str(fork)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=SOURCE_TREE) as tool:
        script = wait_for(root / "examples/me")
        tool.send_signal(number)
        output, _ = tool.communicate()
    assert output == ("interrupted\n" if number is signal.SIGINT else "")
    pids = [script, *daemons(root)]
    if number is signal.SIGINT:  # it had time to clean up
        assert not any(is_alive(pid) for pid in pids)
    assert all(wait_until_ended(pid) for pid in pids)
    folder = Path((root / "examples/tmp").read_text()).parent
    assert folder.name.startswith("coursebuild.")
    wait_until(lambda: not folder.exists(), "the end of the temporary folder")


def test_unwanted_run_is_stopped(root: Path) -> None:
    (root / "examples/x.py").write_text(f"{RECORD_PID}time.sleep(60)\n")
    (root / "examples/y.py").write_text("print('y')\n")

    def unwanted(running: frozenset[str]) -> bool:
        return (root / "examples/me").exists() and running == {"examples/x.py"}

    jobs = [job("examples/x.py"), job("examples/y.py")]
    with ScriptServer() as server:
        with pytest.raises(RunStoppedError):
            server.run(root, jobs, parallel=2, is_unwanted=unwanted)
        assert wait_until_ended(wait_for(root / "examples/me"))
        (after,) = server.run(root, jobs[1:], parallel=2, is_unwanted=lambda running: False)
        assert after.stdout == "y\n"


def test_error_in_a_callback_ends_the_run(server: ScriptServer, root: Path) -> None:
    (root / "examples/x.py").write_text(f"{RECORD_PID}time.sleep(60)\n")
    (root / "examples/y.py").write_text(
        "import os, time\nwhile not os.path.exists('examples/me'): time.sleep(0.01)\n"
    )

    def listen(run: ScriptRun) -> None:
        raise RuntimeError("listener")

    with pytest.raises(RuntimeError, match="listener"):
        server.run(root, [job(), job("examples/y.py")], parallel=2, on_finish=listen)
    assert not is_alive(wait_for(root / "examples/me"))


def test_results_are_in_order_and_callbacks_are_called(server: ScriptServer, root: Path) -> None:
    """The first script is the last to end: it waits for what the last one writes."""
    wait = "import os, time\nwhile not os.path.exists('examples/met'): time.sleep(0.001)"
    for i, code in enumerate((wait, "", "", "open('examples/met', 'w').close()")):
        (root / f"examples/{i}.py").write_text(f"print({i})\n{code}\n")
    started_paths: list[str] = []
    finished_runs: list[ScriptRun] = []
    jobs = [job(f"examples/{i}.py") for i in range(4)]
    runs = server.run(
        root, jobs, parallel=2, on_start=started_paths.append, on_finish=finished_runs.append
    )
    assert [r.stdout for r in runs] == ["0\n", "1\n", "2\n", "3\n"]
    assert started_paths == [j.path for j in jobs]
    assert sorted(finished_runs, key=lambda r: r.path) == list(runs)


def test_no_more_scripts_at_a_time_than_allowed(server: ScriptServer, root: Path) -> None:
    """Each script waits for as many as may run at a time to have begun."""
    (root / "examples/x.py").write_text(
        "import os, sys, time\nopen(f'examples/run{os.getpid()}', 'w').close()\n"
        "def runs(): return len([n for n in os.listdir('examples') if n.startswith('run')])\n"
        "while runs() < int(sys.argv[1]): time.sleep(0.001)\n"
    )
    events: list[int] = []
    runs = server.run(
        root,
        [job(args=["3"])] * 6,
        parallel=3,
        on_start=lambda _: events.append(1),
        on_finish=lambda _: events.append(-1),
    )
    assert {run.outcome for run in runs} == {Outcome.OK}
    assert max(itertools.accumulate(events)) == 3
