"""`--cluster`: the same as on one machine, on workers that die, differ or are not there."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from coursebuild.core.files.errors import EffectError
from coursebuild.core.model.results import ScriptJob
from support.fixture_cases import fixture_tables, fixture_text
from support.local_cluster import install_plugin, local_cluster
from support.sandboxes import require_sandbox
from support.scratch_course import (
    GOOD,
    ROOT,
    CommandResult,
    Folder,
    Make,
    block,
    kill_at_end,
    maker,
    wait_until_alone,
    without_seconds,
)
from support.waiting import wait_for_file, wait_until

pytestmark = pytest.mark.long

PENDULUM = fixture_text("documents/cluster_pendulum.xml")
SCENARIO = fixture_text("documents/cluster_scenario.toml")
WRITES = fixture_text("scripts/cluster_writes.txt")
LIMITS = "[limits]\nscripts = 512\n"
WORKER = fixture_text("scripts/cluster_worker.txt")
"""The process of Dask's worker: that of the child that has started this script's supervisor."""
SCRIPTS = fixture_tables("cluster_scripts")["scripts"]


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Where Python finds the package, installed as pip does it."""
    return install_plugin(tmp_path_factory.mktemp("packages"))


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory, path: str) -> Iterator[str]:
    """The scheduler of two workers."""
    with local_cluster(tmp_path_factory.mktemp("workers"), 2, path) as address:
        yield address


@pytest.fixture
def make(tmp_path: Path, stores: Path) -> Make:
    return maker(tmp_path, stores)


@pytest.fixture
def run(path: str) -> Callable[..., CommandResult]:
    def run(folder: Folder, *arguments: str, **variables: str) -> CommandResult:
        return folder.run(*arguments, env=environment(path) | variables)

    return run


def environment(path: str) -> dict[str, str]:
    # Warnings are those of Dask, about itself.
    return {"PYTHONPATH": path, "PYTHONWARNINGS": "ignore"}


def furnish(folder: Folder) -> Folder:
    folder.write("models/arm.xml", PENDULUM)
    folder.write("data/numbers.txt", "1 2 3\n")
    (folder.root / "data/link.txt").symlink_to("numbers.txt")
    folder.write(".hidden", "secret\n")
    return folder


def twins(make: Make, *lessons: str) -> tuple[Folder, Folder]:
    """Two courses that are the same."""
    return tuple(furnish(make(*lessons, name=f"{name}/a cöurse")) for name in "ab")  # type: ignore[return-value]


def without_place(folder: Folder, text: str) -> str:
    """A report, whose order among scripts of the same length is the course's."""
    return without_seconds(text).replace(str(folder.root), "ROOT")


def test_scripts_do_the_same_as_on_one_machine(
    make: Make, run: Callable[..., CommandResult], address: str
) -> None:
    lesson = "## One\n\n"
    for name, (code, output) in SCRIPTS.items():
        info = "timeout=1" if name == "loops" else ""
        lesson += block(f"{name}.py", code, output, info=info)
    lesson += block("writes.py", WRITES, info="writes=runs")
    first_course, second_course = twins(make, lesson)
    for folder in (first_course, second_course):
        folder.replace("content/course.toml", "[course]\n", f"{LIMITS}\n[course]\n")
    reports = [run(first_course, "check"), run(second_course, "check", "--cluster", address)]
    assert [report.status for report in reports] == [1, 1], reports[1].err
    first, second = map(
        without_place, (first_course, second_course), (report.out for report in reports)
    )
    assert second == first
    for outcome in ("ok", "drift", "failed", "timeout"):
        assert re.search(rf"^{outcome} ", first, re.MULTILINE), first
    assert second_course.read("runs/new.txt") == first_course.read("runs/new.txt") == b"7"
    reports = [run(first_course, "update"), run(second_course, "update", "--cluster", address)]
    first, second = map(
        without_place, (first_course, second_course), (report.out for report in reports)
    )
    assert second == first
    lessons = [folder.text(folder.lesson()) for folder in (first_course, second_course)]
    assert lessons[1].replace(str(second_course.root), "") == lessons[0].replace(
        str(first_course.root), ""
    )
    assert "1 2 3" in lessons[0]
    # What a worker has found out is remembered like what this machine has.
    results = [run(folder, "check", "-v") for folder in (first_course, second_course)]
    paths = [
        set(re.findall(r"^  (examples/\S+\.py)", result.err, re.MULTILINE)) for result in results
    ]
    assert paths[1] == paths[0] == {"examples/imports.py", "examples/loops.py"}


def test_measurements_are_the_same_as_on_one_machine(
    make: Make, run: Callable[..., CommandResult], address: str
) -> None:
    first_course, second_course = twins(make, GOOD)
    for folder in (first_course, second_course):
        folder.write("models/arm.toml", SCENARIO.format([0.01 * (n + 1) for n in range(6)]))
    assert run(first_course, "bench", "--record").status == 0
    folder = "content/reports"
    for name, data in first_course.tree(folder).items():
        second_course.write(f"{folder}/{name}", data)
    arguments = ("bench", "--check", "--format", "json")
    first, second = (
        run(first_course, *arguments),
        run(second_course, *arguments, "--cluster", address),
    )
    assert second.out == first.out
    assert "measured here" not in second.err
    assert len(json.loads(first.out)["scenes"][0]["sweeps"][0]["rows"]) == 6

    first, second = (
        run(first_course, "diet", "--fix"),
        run(second_course, "diet", "--fix", "--cluster", address),
    )
    assert first.status == second.status == 0, second.err
    assert "measured here" not in second.err
    assert second_course.read("models/arm.xml") == first_course.read("models/arm.xml")
    assert b"unused" not in second_course.read("models/arm.xml")
    assert "changed models/arm.xml: unused-material" in second.out

    arguments = ("stability", "projectile", "--format", "json")
    first, second = (
        run(first_course, *arguments),
        run(second_course, *arguments, "--cluster", address),
    )
    reports = [json.loads(result.out) for result in (first, second)]
    for report in reports:
        assert [case["costs"] != [] for case in report] == [True]
        for name in ("costs", "charts", "reached"):  # what holds times
            report[0].pop(name)
    assert reports[1] == reports[0]
    assert "measured here" not in second.err


def test_the_sandbox_holds_on_a_worker(
    make: Make, run: Callable[..., CommandResult], address: str, tmp_path: Path
) -> None:
    secret = tmp_path / "secret"
    secret.write_text("of somebody")
    code = f"import os\nprint(os.path.exists({str(secret)!r}), os.getpid() < 100)"
    folder = make("## One\n\n" + block("looks.py", code, "False True"))
    require_sandbox(folder.root)
    result = run(folder, "check", "--sandbox", "--cluster", address)
    assert result.status == 0, result.out + result.err
    assert run(folder, "check", "--no-cache", "--cluster", address).status == 1


def test_a_killed_worker_costs_its_task_only(
    make: Make, path: str, address: str, tmp_path: Path
) -> None:
    marker = tmp_path / "marker"
    code = (
        f"{WORKER}marker = pathlib.Path({str(marker)!r})\n"
        "if not marker.exists():\n"
        "    marker.with_name('part').write_text(str(worker))\n"
        "    marker.with_name('part').rename(marker)\n"
        "    while True: pass\n"
        "print(7)"
    )
    rest = "".join(block(f"{n}.py", f"print({n})", f"{n}") for n in "12")
    folder = make("## One\n\n" + block("waits.py", code, "7") + rest)
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    arguments = ("check", "--cluster", address)
    with kill_at_end(folder.start(*arguments, env=environment(path), **pipes)) as process:
        wait_for_file(marker)
        os.kill(int(marker.read_text()), signal.SIGKILL)
        out, err = process.communicate()
    assert process.returncode == 0, out + err
    assert len(re.findall(rb"^ok ", out, re.MULTILINE)) == 3


def test_a_script_that_kills_its_worker_each_time(
    make: Make, run: Callable[..., CommandResult], tmp_path: Path, path: str
) -> None:
    """On workers of its own, since Dask gives up those that die while they start."""
    kills = block("kills.py", f"{WORKER}os.kill(worker, 9)\nprint(1)", "1")
    rest = "".join(block(f"{n}.py", f"print({n})", f"{n}") for n in "1234")
    folder = make("## One\n\n" + kills + rest)
    with local_cluster(tmp_path / "workers", 4, path) as address:
        result = run(folder, "check", "--cluster", address)
    assert result.status == 1
    assert len(re.findall("^ok ", result.out, re.MULTILINE)) == 4
    assert "each of the 3 workers that ran this script died" in result.out
    assert re.search("^killed +examples/kills.py", result.out, re.MULTILINE)


def test_ctrl_c_leaves_nothing_running(make: Make, path: str, address: str, tmp_path: Path) -> None:
    for name, cluster in {"lasting": address, "local": "local"}.items():
        marker = tmp_path / f"{name}.marker"
        code = f"""\
import os
with open({str(marker)!r}, "w") as file:
    file.write(f"{{os.getpid():9}}")
while True: pass
"""
        folder = make("## One\n\n" + block("loops.py", code, "1"), name=f"{name}/a cöurse")
        process = folder.start("check", "--cluster", cluster, env=environment(path))
        with kill_at_end(process):
            wait_for_file(marker, 9)
            script = int(marker.read_text())
            os.killpg(process.pid, signal.SIGINT)
            assert process.wait() == 128 + signal.SIGINT
        wait_until(lambda script=script: not Path(f"/proc/{script}").exists(), "the script's end")
        wait_until_alone(folder)
    assert tasks_of(address) == 0


def tasks_of(address: str) -> int:
    """How many tasks a scheduler knows."""
    code = (
        "import sys, distributed\n"
        "with distributed.Client(sys.argv[1]) as client:\n"
        "    print(sum(map(len, client.processing().values())))"
    )
    command = [sys.executable, "-W", "ignore", "-c", code, address]
    return int(subprocess.run(command, capture_output=True, check=True).stdout)


def test_a_worker_of_another_version_is_refused(
    make: Make, run: Callable[..., CommandResult], path: str, tmp_path: Path
) -> None:
    package = tmp_path / "other/numpy-9.9.dist-info"
    package.mkdir(parents=True)
    (package / "METADATA").write_text("Name: numpy\nVersion: 9.9\n")
    with local_cluster(tmp_path / "workers", 1, f"{package.parent}:{path}") as address:
        result = run(make(GOOD), "check", "--cluster", address)
    assert result.status == 1
    *_, message, help = result.err.splitlines()
    refusal = r"coursebuild: --cluster: no worker can be used: \S+ is refused: it has NumPy 9\.9, "
    assert re.fullmatch(rf"{refusal}here is \d\S+", message), result.err
    assert help.strip() == "help: install the same there as here"


def test_what_is_not_there(
    make: Make, run: Callable[..., CommandResult], tmp_path: Path, path: str
) -> None:
    folder = make(GOOD)
    quick = {"DASK_DISTRIBUTED__COMM__TIMEOUTS__CONNECT": "1s"}
    result = run(folder, "check", "--cluster", "tcp://127.0.0.1:1", **quick)
    assert result.status == 1
    message = "coursebuild: --cluster: there is no Dask scheduler at `tcp://127.0.0.1:1`: "
    assert result.err.startswith(message)
    (tmp_path / "distributed.py").write_text("raise ModuleNotFoundError(name='distributed')")
    result = run(folder, "check", "--cluster", "local", PYTHONPATH=f"{tmp_path}:{path}")
    assert (result.status, result.err) == (
        1,
        "coursebuild: --cluster needs the package distributed\n"
        "  help: run `pip install 'dask[distributed]'`\n",
    )
    result = folder.run("check", "--cluster", "local")
    assert (result.status, result.err) == (
        2,
        "coursebuild: there is no option `--cluster`; run `pip install 'coursebuild[cluster]'`\n",
    )
    result = run(folder, "update", "--long", "--cluster", "local")
    assert result.err == "coursebuild: --long cannot be combined with --cluster\n"
    result = run(folder, "check", "--cluster", "local", "--against", "3.13.0")
    assert result.err == "coursebuild: --against cannot be combined with --cluster\n"


@pytest.mark.parametrize("path", ["content/a.md", "runs/../content/a.md", "runs/link/a.md", "runs"])
def test_a_worker_writes_only_where_its_script_may(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, path: str
) -> None:
    monkeypatch.syspath_prepend(str(ROOT / "plugins/cluster"))
    from coursebuild_cluster.results import write_output

    (tmp_path / "content").mkdir()
    (tmp_path / "runs").mkdir()
    (tmp_path / "runs/link").symlink_to(tmp_path / "content")
    job = ScriptJob("examples/a.py", (), 1.0, (), writes=("runs/",))
    with pytest.raises(EffectError, match="may not write"):
        write_output(tmp_path, job, path, b"x")
    write_output(tmp_path, job, "runs/new/a.txt", b"x")
    assert [*(tmp_path / "content").iterdir()] == []
