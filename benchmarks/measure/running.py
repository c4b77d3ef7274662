"""Scripts: what running them takes, beside the time that they compute.

Entry point: `measure_scripts`. The yardstick is one process that has imported NumPy and MuJoCo and
executes all scripts one after the other: only the execution is counted, no start and no import. It
takes part in each round like the others, and each figure is divided by that of its own round.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from benchmarks.courses import write_course
from benchmarks.measure.building import remove
from benchmarks.measure.process import CommandError, timed
from benchmarks.measure.tools import Places, environment, said_version

COMPUTE = """
import contextlib, io, pathlib, sys, time
import mujoco, numpy
total = 0.0
for path in sys.argv[1:]:
    code = compile(pathlib.Path(path).read_text(), path, "exec")
    with contextlib.redirect_stdout(io.StringIO()):
        began = time.perf_counter()
        exec(code, {"__name__": "__main__"})
        total += time.perf_counter() - began
print(total)
"""
RUNNER = """
import pathlib, sys, time
from coursebuild.core.run.runner import ScriptServer
from coursebuild.core.engine.memo import Memo
from coursebuild.pipeline.load import load
from coursebuild.pipeline.options import Options
from coursebuild.pipeline.progress import Progress
from coursebuild.pipeline.scripts import extract_scripts, run
root = pathlib.Path.cwd()
with ScriptServer() as server:
    store = Memo(root, fresh=True)
    options = Options(root, int(sys.argv[1]), True, store, run_all=server.run)
    chosen = extract_scripts(load(root).value, options).runnable
    for _ in range(2):
        began = time.perf_counter()
        runs = run(chosen, options, Progress(quiet=True))
        print(time.perf_counter() - began)
        assert len(runs) == len(chosen) and all(run.outcome.value == "ok" for run in runs)
"""
"""The second time what the scripts import is there already, as it is in the live preview and when
`update` runs scripts again."""
CACHED = ("jupyter-cache, parallel", "jupyter-cache, nothing changed")
CONSENT = """
import subprocess, sys
sys.exit(subprocess.run(sys.argv[1:], input=b"y\\n").returncode)
"""
"""Runs a command and says yes: jupyter-cache asks before it makes its folder."""


@dataclass(slots=True)
class Scripts:
    """A course whose scripts are run in all ways."""

    folder: Path
    cores: int
    places: Places
    compute: list[float] = field(default_factory=list)
    """Seconds of pure computing, a figure for each round."""
    found: dict[str, list[float]] = field(default_factory=dict)
    """Seconds of each way, a figure for each round."""
    failed: str = ""
    """What could not be run: then it has no figures."""

    @property
    def paths(self) -> list[str]:
        """The scripts."""
        return sorted(str(p.relative_to(self.folder)) for p in self.folder.glob("examples/l*.py"))

    def ratios(self, way: str) -> list[float]:
        """Seconds over seconds of computing, round by round."""
        return [a / b for a, b in zip(self.found[way], self.compute, strict=True)]


def measure_scripts(
    count: int, rounds: int, work: Path, places: Places, say: Callable[[str], None]
) -> Scripts:
    """All ways, in rounds."""
    folder = work / "scripts"
    remove(folder)
    write_course(folder, count, "coursebuild", "mujoco")
    scripts = Scripts(folder, len(os.sched_getaffinity(0)), places)
    python = [sys.executable, "-m", "coursebuild"]
    timed([*python, "extract", "--quiet"], folder, environment(places))
    for turn in range(rounds):
        say(f"{count} scripts, round {turn + 1} of {rounds}")
        one_round(scripts)
    return scripts


def one_round(scripts: Scripts) -> None:
    """Each way once."""
    scripts.compute += numbers(scripts, [sys.executable, "-c", COMPUTE, *scripts.paths])
    note(scripts, "python, one by one", one_by_one(scripts))
    note(scripts, f"xargs -P{scripts.cores}", spread(scripts))
    cold, warm = numbers(scripts, [sys.executable, "-c", RUNNER, str(scripts.cores)])
    note(scripts, "coursebuild, with its start", cold)
    note(scripts, "coursebuild, once more", warm)
    check = [sys.executable, "-m", "coursebuild", "check", "--no-cache", "--quiet"]
    environment_ = environment(scripts.places)
    note(scripts, "coursebuild check --no-cache", timed(check, scripts.folder, environment_))
    again = [sys.executable, "-m", "coursebuild", "check", "--quiet"]
    touched(scripts)
    note(scripts, "coursebuild check, text edited", timed(again, scripts.folder, environment_))
    program = scripts.places.python_tool("jcache")
    if program is not None and not scripts.failed:
        try:
            for way, seconds in zip(CACHED, notebooks(scripts, program), strict=True):
                note(scripts, way, seconds)
        except CommandError as fault:
            scripts.failed = str(fault)
            for way in CACHED:
                scripts.found.pop(way, None)


def note(scripts: Scripts, way: str, seconds: float) -> None:
    """Keep a figure."""
    scripts.found.setdefault(way, []).append(seconds)


def touched(scripts: Scripts) -> None:
    """Change the text of a lesson, so that `check` has something to do but no script to run."""
    path = min(scripts.folder.glob("content/lessons/*.md"))
    path.write_text(path.read_text(encoding="utf-8") + "\nOne more sentence.\n", encoding="utf-8")


def numbers(scripts: Scripts, command: list[str]) -> list[float]:
    """The numbers that a command prints."""
    done = subprocess.run(
        command,
        cwd=scripts.folder,
        env=environment(scripts.places) | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        raise CommandError(done.stderr[-2000:])
    return [float(word) for word in done.stdout.split()]


def one_by_one(scripts: Scripts) -> float:
    """A process for each script, one after the other."""
    return sum(
        timed([sys.executable, path], scripts.folder, environment(scripts.places))
        for path in scripts.paths
    )


def spread(scripts: Scripts) -> float:
    """A process for each script, as many at a time as there are cores."""
    listed = "\n".join(scripts.paths)
    inner = f'printf "%s" "$1" | xargs -P{scripts.cores} -n1 "{sys.executable}" >/dev/null'
    command = ["sh", "-c", inner, "sh", listed + "\n"]
    return timed(command, scripts.folder, environment(scripts.places))


def notebooks(scripts: Scripts, program: str) -> tuple[float, float]:
    """A notebook for each script: first nothing is cached, then everything."""
    folder = scripts.folder / "notebooks"
    remove(folder)
    folder.mkdir()
    for path in scripts.paths:
        text = (scripts.folder / path).read_text(encoding="utf-8")
        target = folder / Path(path).with_suffix(".ipynb").name
        target.write_text(json.dumps(notebook(text)), encoding="utf-8")
    paths = environment(scripts.places) | {"JUPYTERCACHE": str(folder / ".jupyter_cache")}
    paths["PATH"] = f"{Path(program).parent}:{paths['PATH']}"
    listed = sorted(path.name for path in folder.glob("*.ipynb"))
    timed([sys.executable, "-c", CONSENT, program, "notebook", "add", *listed], folder, paths)
    execute = [program, "project", "execute", "--executor", "local-parallel", "--timeout", "120"]
    cold = timed(execute, folder, paths)
    cached = len(list((folder / ".jupyter_cache" / "executed").iterdir()))
    if cached != len(listed):
        raise CommandError(f"jupyter-cache has run {cached} notebooks of {len(listed)}")
    warm = timed(execute, folder, paths)
    shutil.rmtree(folder)
    return cold, warm


def notebook(code: str) -> dict[str, object]:
    """A notebook of one cell."""
    cell: dict[str, object] = {
        "cell_type": "code",
        "execution_count": None,
        "id": "script",
        "metadata": {},
        "outputs": [],
        "source": code,
    }
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    return {"cells": [cell], "metadata": {"kernelspec": kernel}, "nbformat": 4, "nbformat_minor": 5}


def jcache_version(places: Places) -> str | None:
    """Of jupyter-cache."""
    program = places.python_tool("jcache")
    return None if program is None else said_version([program, "--version"])
