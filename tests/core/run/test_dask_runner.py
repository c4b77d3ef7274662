"""Scripts on a Dask cluster: a real scheduler and real workers, each a process of its own."""

from __future__ import annotations

import contextlib
import importlib.metadata
import io
import json
import os
import signal
import subprocess
import sys
import threading
import time
import zipfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from msgspec.structs import replace

from coursebuild.cli import main
from coursebuild.core.files.errors import EffectError
from coursebuild.core.model.results import Outcome, ScriptJob, ScriptRun
from coursebuild.core.run import dask_runner
from coursebuild.core.run.dask_runner import archive, is_dask, run_on_dask
from coursebuild.core.run.runner import RunEvent, RunFinished, RunStarted, run_scripts
from support.runners import wait_until

pytestmark = [
    pytest.mark.site,
    pytest.mark.filterwarnings("ignore"),  # what Dask warns of is not ours
]

ROOT = Path(dask_runner.__file__).parents[3]
QUIET = {
    **os.environ,
    "PYTHONPATH": str(ROOT),
    "DASK_DISTRIBUTED__DASHBOARD__LINK": "",
    "DASK_DISTRIBUTED__SCHEDULER__WORKER_TTL": "5 minutes",
}


class Cluster:
    """A scheduler, and workers to be added and killed."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.processes: list[subprocess.Popen[bytes]] = []
        told = folder / "scheduler.json"
        # Any free port: one that was looked for before may be taken by then.
        where = ("--host", "127.0.0.1", "--port", "0", "--scheduler-file", str(told))
        self.scheduler = self._start("scheduler", *where, "--no-dashboard")
        self.address = self._address(told)
        self.url = f"dask://{self.address}"

    def _address(self, told: Path) -> str:
        while self.scheduler.poll() is None:
            with contextlib.suppress(OSError, ValueError):  # not there yet, or not whole
                return str(json.loads(told.read_text())["address"]).removeprefix("tcp://")
            time.sleep(0.005)
        raise AssertionError("the scheduler ended")

    def worker(self, **environment: str) -> subprocess.Popen[bytes]:
        return self._start(
            *("worker", f"tcp://{self.address}", "--nthreads", "1", "--no-nanny"),
            *("--no-dashboard", "--host", "127.0.0.1", "--death-timeout", "300"),
            *("--local-directory", str(self.folder)),
            **environment,
        )

    def wait_for_workers(self, count: int) -> None:
        import distributed  # a second, which all who collect this file would wait

        with distributed.Client(  # type: ignore[no-untyped-call]
            f"tcp://{self.address}", set_as_default=False
        ) as client:
            client.wait_for_workers(count, timeout=300)

    def _start(self, *arguments: str, **environment: str) -> subprocess.Popen[bytes]:
        process = subprocess.Popen(
            [sys.executable, "-m", "dask", *arguments],
            env={**QUIET, **environment},
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        self.processes.append(process)
        return process

    def stop(self) -> None:
        for process in reversed(self.processes):
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cluster]:
    cluster = Cluster(tmp_path_factory.mktemp("dask"))
    try:
        for _ in range(2):
            cluster.worker()
        cluster.wait_for_workers(2)
        yield cluster
    finally:
        cluster.stop()


@pytest.fixture
def own_cluster(tmp_path: Path) -> Iterator[Cluster]:
    cluster = Cluster(tmp_path)
    try:
        yield cluster
    finally:
        cluster.stop()


@pytest.fixture
def root(tmp_path: Path) -> Path:
    root = tmp_path / "course"
    texts = {
        "models/m.xml": "<mujoco><worldbody><body mass='1'/></worldbody></mujoco>",
        "content/data/d.csv": "1,2\n",
        "examples/hello.py": "print('hello é')\n",
        "examples/args.py": "import sys\nprint(sys.argv[1:])\n",
        "examples/data.py": "print(open('content/data/d.csv').read().strip())\n",
        "examples/helper.py": "ANSWER = 42\n",
        "examples/uses.py": "import helper\nprint(helper.ANSWER)\n",
        "examples/fails.py": "print('begun')\nraise ValueError('no')\n",
        "examples/exits.py": "import sys\nsys.exit(3)\n",
        "examples/long.py": "import signal\nsignal.pause()\n",
        "examples/bytes.py": "import sys\nsys.stdout.buffer.write(b'\\xff')\n",
        "examples/kills.py": "import os, signal\nos.kill(os.getpid(), signal.SIGKILL)\n",
        "examples/mj.py": (
            "import mujoco\nprint(mujoco.MjModel.from_xml_path('models/m.xml').nbody)\n"
        ),
        "examples/lost.py": (
            "import mujoco\n"
            "body = '<body><joint/><geom size=\"1\"/></body>'\n"
            "xml = f'<mujoco><worldbody>{body}</worldbody></mujoco>'\n"
            "model = mujoco.MjModel.from_xml_string(xml)\n"
            "data = mujoco.MjData(model)\n"
            "data.qvel[0] = 1e20\n"
            "mujoco.mj_step(model, data)\n"
        ),
    }
    for path, text in texts.items():
        (root / path).parent.mkdir(parents=True, exist_ok=True)
        (root / path).write_text(text)
    return root


def job(name: str, *args: str, timeout: float = 120.0, **more: object) -> ScriptJob:
    return replace(ScriptJob(f"examples/{name}.py", args, timeout, (), False), **more)  # type: ignore[arg-type]


def told(run: ScriptRun) -> ScriptRun:
    """What must be the same wherever it ran."""
    return replace(run, seconds=0.0)


def test_results_are_the_same_as_here(cluster: Cluster, root: Path) -> None:
    jobs = [
        *(job("hello"), job("args", "a b", "é"), job("data"), job("uses"), job("fails")),
        *(job("exits"), job("bytes"), job("kills"), job("mj"), job("hello", norun=True)),
        *(job("absent"), job("mj", requires=("no_such_module_here",)), job("lost", perturbation=1)),
        job("long", timeout=0.5),
    ]
    events: list[RunEvent] = []
    there = run_on_dask(cluster.url, root, jobs, on_event=events.append)
    here = run_scripts(root, jobs, parallel=2)
    for ours, theirs in zip(here, there, strict=True):
        if ours.outcome is Outcome.TIMEOUT:  # where it stood when it was stopped is a race
            assert theirs.outcome is Outcome.TIMEOUT
        else:
            assert told(theirs) == told(ours)
    started = [event.path for event in events if isinstance(event, RunStarted)]
    assert started == [job.path for job in jobs if not job.norun]
    finished = [event for event in events if isinstance(event, RunFinished)]
    assert [event.done for event in finished] == list(range(1, len(jobs)))
    assert {event.total for event in finished} == {len(jobs) - 1}


def test_a_script_may_write_and_no_other_sees_it(cluster: Cluster, root: Path) -> None:
    (root / "examples/writes.py").write_text(
        "from pathlib import Path\np = Path('content/new.txt')\n"
        "print(p.exists())\np.write_text('x')\n"
    )
    runs = run_on_dask(cluster.url, root, [job("writes")] * 4)
    assert [run.stdout for run in runs] == ["False\n"] * 4
    assert not (root / "content/new.txt").exists()


def test_a_lost_worker_costs_a_retry_not_a_result(own_cluster: Cluster, root: Path) -> None:
    """The worker is killed once its script has begun, which then never ends by itself."""
    started = root.parent / "started"
    (root / "examples/slow.py").write_text(
        f"import signal\nfrom pathlib import Path\np = Path({str(started)!r})\n"
        "first = not p.exists()\np.touch()\nif first: signal.pause()\nprint('done')\n"
    )
    victim = own_cluster.worker()

    def replace_worker() -> None:
        wait_until(started.exists, "the start of the script")
        os.killpg(victim.pid, signal.SIGKILL)
        own_cluster.worker()

    thread = threading.Thread(target=replace_worker)
    thread.start()
    runs = run_on_dask(
        own_cluster.url, root, [job("slow", timeout=600.0), job("hello")], patience=120.0
    )
    thread.join()
    assert [(run.outcome, run.stdout) for run in runs] == [
        (Outcome.OK, "done\n"),
        (Outcome.OK, "hello é\n"),
    ]


def test_a_script_that_takes_every_worker_along_counts_as_killed(
    own_cluster: Cluster, root: Path
) -> None:
    (root / "examples/murder.py").write_text(
        "import os, signal\nfrom pathlib import Path\n"
        "def parent(p):\n"
        "    return int(Path(f'/proc/{p}/stat').read_text().rpartition(')')[2].split()[1])\n"
        "p = os.getpid()\n"
        "while 'dask' not in Path(f'/proc/{p}/cmdline').read_text(): p = parent(p)\n"
        "os.kill(p, signal.SIGKILL)\nsignal.pause()\n"
    )
    workers = [own_cluster.worker() for _ in range(5)]
    own_cluster.wait_for_workers(5)
    [run] = run_on_dask(own_cluster.url, root, [job("murder")])
    assert run.outcome is Outcome.KILLED
    assert run.stderr == "worker after worker was lost while this script ran\n"
    assert sum(worker.poll() is None for worker in workers) < 5


def test_a_worker_with_other_versions_runs_nothing(own_cluster: Cluster, root: Path) -> None:
    """NumPy's version is what its metadata say: the worker finds others first."""
    metadata = root.parent / "other/numpy-9.9.dist-info/METADATA"
    metadata.parent.mkdir(parents=True)
    metadata.write_text("Metadata-Version: 2.1\nName: numpy\nVersion: 9.9\n")
    own_cluster.worker(PYTHONPATH=f"{metadata.parents[1]}:{ROOT}")
    ours = importlib.metadata.version("numpy")
    with pytest.raises(EffectError) as caught:
        run_on_dask(own_cluster.url, root, [job("hello")], patience=120.0)
    assert caught.value.message == (
        f"a worker of {own_cluster.url} would give other results: "
        f"NumPy is 9.9 there and {ours} here"
    )
    assert caught.value.help == "install the same versions on every worker"


def test_no_scheduler(root: Path) -> None:
    with pytest.raises(EffectError, match=r"^the Dask scheduler dask://127\.0\.0\.1:1 cannot be"):
        run_on_dask("dask://127.0.0.1:1", root, [job("hello")], patience=0.2)


def test_no_workers(own_cluster: Cluster, root: Path) -> None:
    for patience in (1.0, 120.0):  # the scheduler is there, however slow
        with pytest.raises(EffectError) as caught:
            run_on_dask(own_cluster.url, root, [job("hello")], patience=patience)
        if "cannot be reached" not in caught.value.message:
            break
    assert caught.value.message == f"the Dask cluster {own_cluster.url} has no workers"


def test_a_scheduler_that_goes_away(own_cluster: Cluster, root: Path) -> None:
    own_cluster.worker()

    def event(event: RunEvent) -> None:
        if isinstance(event, RunFinished):
            os.killpg(own_cluster.scheduler.pid, signal.SIGKILL)

    with pytest.raises(EffectError, match=r"^the Dask cluster dask://127.0.0.1:\d+ went away"):
        jobs = [job("hello"), job("long", timeout=600.0)]
        run_on_dask(own_cluster.url, root, jobs, on_event=event, patience=120.0)


def test_what_interrupts_the_run_ends_it(cluster: Cluster, root: Path) -> None:
    def event(event: RunEvent) -> None:
        if isinstance(event, RunFinished):
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_on_dask(cluster.url, root, [job("hello")] * 6, on_event=event)
    [run] = run_on_dask(cluster.url, root, [job("hello")])  # the cluster is as good as before
    assert run.stdout == "hello é\n"


def test_dask_is_optional(root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(EffectError) as caught:
        run_on_dask("dask://127.0.0.1:1", root, [job("hello")])
    assert caught.value.message == "Dask is not installed"
    assert caught.value.help == "run `pip install 'coursebuild[dask]'`"


def test_addresses() -> None:
    for url in ("dask://h:1", "dask+tls://h:1"):
        assert is_dask(url), url
    for url in ("h:1", "dask://h", "dask://:1", "dask://h:99999", "ssh://h"):
        assert not is_dask(url), url


def test_the_archive_holds_what_scripts_may_need_and_nothing_else(root: Path) -> None:
    (root / "public").mkdir()
    (root / "public/index.html").touch()
    for name in (".git", ".coursebuild", "env", "site-copy", "examples/__pycache__"):
        (root / name).mkdir()
        (root / name / "x").touch()
    (root / "env/pyvenv.cfg").touch()
    (root / "site-copy/.coursebuild-site").touch()
    (root / "content/out").symlink_to("/etc")
    (root / "content/passwd").symlink_to("/etc/passwd")
    (root / "content/d2.csv").symlink_to(root / "content/data/d.csv")
    (root / "leer é.txt").touch()
    data = archive(root)
    with zipfile.ZipFile(io.BytesIO(data)) as files:
        names = files.namelist()
        assert files.read("content/d2.csv") == b"1,2\n"
    examples = [f"examples/{p.name}" for p in (root / "examples").glob("*.py")]
    assert sorted(names) == sorted(
        [*examples, "content/data/d.csv", "content/d2.csv", "models/m.xml", "leer é.txt"]
    )
    for path in root.rglob("*"):
        os.utime(path, (1, 1), follow_symlinks=False)
    assert archive(root) == data


def test_a_course_too_large_to_send(root: Path) -> None:
    with (root / "content/large.bin").open("wb") as file:
        file.truncate(513 << 20)  # takes no room
    with pytest.raises(EffectError) as caught:
        archive(root)
    assert caught.value.message == "the course has more than 512 MiB of files, too much to send"


MAP = """[course]
title = "A course"
summary = "For trying."
language = "en"

[[level]]
id = "1"
title = "Level"
summary = "All of it."

[[level.lesson]]
id = "1.1"
slug = "one"
title = "One"
summary = "A lesson."
status = "complete"
"""


def test_check_runs_scripts_on_a_cluster_and_remembers_them(
    cluster: Cluster, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    root = tmp_path / "course"
    lesson = root / "content/lessons/1.1-one.md"
    lesson.parent.mkdir(parents=True)
    (root / "content/course.toml").write_text(MAP)
    text = (
        "## One\n\n```python file=examples/one.py\nprint({})\n```\n\nOutput:\n\n```text\n1\n```\n"
    )
    command = ["-C", str(root), "check", "--executor", cluster.url]
    lesson.write_text(text.format(1))
    assert main(command) == 0
    assert "  examples/one.py: ok after" in capsys.readouterr().err
    lesson.write_text(text.format(1) + "\nMore prose.\n")
    assert main(command) == 0
    assert capsys.readouterr().out.splitlines()[0] == "ok       examples/one.py  cached"
    lesson.write_text(text.format(2))
    assert main(command) == 1
    assert "error[output-drift]" in capsys.readouterr().out


def test_an_executor_that_is_none(capsys: pytest.CaptureFixture[str], root: Path) -> None:
    assert main(["-C", str(root), "check", "--executor", "ssh://host"]) == 2
    assert capsys.readouterr().err == (
        "coursebuild: --executor: 'ssh://host' is no place to run scripts: dask://HOST:PORT\n"
    )
