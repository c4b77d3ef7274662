"""Scripts: the time to run them, compared with the time that they compute.

Entry point: `measure_scripts`. The yardstick is one process that has imported NumPy and MuJoCo and
executes all scripts one after the other: only the execution is counted, no start and no import. It
takes part in each round like the others, and each figure is divided by that of its own round.
"""

from __future__ import annotations

import json
import os
import shutil
import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from benchmarks.courses import write_course
from benchmarks.measure.building import remove
from benchmarks.measure.process import CommandError, time_command
from benchmarks.measure.tools import Places, environment, read_version
from coursebuild.core.run import gate

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
from coursebuild.core.run.script_server import ScriptServer
from coursebuild.core.engine.store import Store
from coursebuild.pipeline.load import load
from coursebuild.pipeline.options import Options
from coursebuild.pipeline.scripts import extract_scripts, run
root = pathlib.Path.cwd()
with ScriptServer() as server:
    store = Store(root, fresh=True)
    options = Options(root, int(sys.argv[1]), store, run_all=server.run)
    course = load(root).value
    chosen = extract_scripts(course, options).runnable
    for _ in range(2):
        began = time.perf_counter()
        runs = run(course, chosen, options)
        print(time.perf_counter() - began)
        assert len(runs) == len(chosen) and all(run.outcome.value == "ok" for run in runs)
"""
"""The second time the modules that scripts import are loaded already, as in the live preview and
when `update` runs scripts again."""
NOTEBOOK_WAYS = ("jupyter-cache, parallel", "jupyter-cache, nothing changed")
CONSENT = ("sh", "-c", 'echo y | "$@"', "sh")
"""Runs a command and says yes: jupyter-cache asks before it makes its folder."""


@dataclass(slots=True)
class Scripts:
    """A course whose scripts are run in all ways."""

    folder: Path
    cores: int
    places: Places
    compute: list[float] = field(default_factory=list)
    """Seconds of pure computing, a figure for each round."""
    figures: dict[str, list[float]] = field(default_factory=dict)
    """Seconds of each way, a figure for each round."""
    failure: str = ""
    """Why jupyter-cache could not run: then it has no figures."""

    @property
    def paths(self) -> list[str]:
        """The scripts."""
        return sorted(str(p.relative_to(self.folder)) for p in self.folder.glob("examples/l*.py"))

    def ratios(self, way: str) -> list[float]:
        """Seconds over seconds of computing, round by round."""
        return [a / b for a, b in zip(self.figures[way], self.compute, strict=True)]


def measure_scripts(
    count: int, rounds: int, work: Path, places: Places, say: Callable[[str], None]
) -> Scripts:
    """All ways, in rounds."""
    folder = work / "scripts"
    remove(folder)
    write_course(folder, count, "coursebuild", "mujoco")
    scripts = Scripts(folder, len(os.sched_getaffinity(0)), places)
    python = [sys.executable, "-m", "coursebuild"]
    time_command([*python, "extract", "--quiet"], folder, environment(places))
    for turn in range(rounds):
        say(f"{count} scripts, round {turn + 1} of {rounds}")
        one_round(scripts)
    return scripts


def one_round(scripts: Scripts) -> None:
    """Each way once."""
    scripts.compute += read_numbers(scripts, [sys.executable, "-c", COMPUTE, *scripts.paths])
    note(scripts, "python, one by one", run_one_by_one(scripts))
    note(scripts, f"xargs -P{scripts.cores}", run_with_xargs(scripts))
    cold, warm = read_numbers(scripts, [sys.executable, "-c", RUNNER, str(scripts.cores)])
    note(scripts, "coursebuild, with its start", cold)
    note(scripts, "coursebuild, once more", warm)
    check = [sys.executable, "-m", "coursebuild", "check", "--no-cache", "--quiet"]
    variables = environment(scripts.places)
    note(scripts, "coursebuild check --no-cache", time_command(check, scripts.folder, variables))
    recheck = [sys.executable, "-m", "coursebuild", "check", "--quiet"]
    touch_lesson(scripts)
    note(
        scripts, "coursebuild check, text edited", time_command(recheck, scripts.folder, variables)
    )
    program = scripts.places.python_tool("jcache")
    if program is not None and not scripts.failure:
        try:
            for way, seconds in zip(NOTEBOOK_WAYS, run_notebooks(scripts, program), strict=True):
                note(scripts, way, seconds)
        except CommandError as error:
            scripts.failure = str(error)
            for way in NOTEBOOK_WAYS:
                scripts.figures.pop(way, None)


def note(scripts: Scripts, way: str, seconds: float) -> None:
    """Record a figure."""
    scripts.figures.setdefault(way, []).append(seconds)


def touch_lesson(scripts: Scripts) -> None:
    """Change the text of a lesson, so that `check` has something to do but no script to run."""
    path = min(scripts.folder.glob("content/lessons/*.md"))
    path.write_text(path.read_text(encoding="utf-8") + "\nOne more sentence.\n", encoding="utf-8")


def read_numbers(scripts: Scripts, command: list[str]) -> list[float]:
    """The numbers that a command prints."""
    threads = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    variables = environment(scripts.places) | threads
    done = gate.finish(command, variables, folder=scripts.folder, bound=False)
    if done.status:
        raise CommandError(done.errors.decode(errors="replace")[-2000:])
    return [float(word) for word in done.output.split()]


def run_one_by_one(scripts: Scripts) -> float:
    """A process for each script, one after the other."""
    return sum(
        time_command([sys.executable, path], scripts.folder, environment(scripts.places))
        for path in scripts.paths
    )


def run_with_xargs(scripts: Scripts) -> float:
    """A process for each script, as many at a time as there are cores."""
    paths = "\n".join(scripts.paths)
    inner = f'printf "%s" "$1" | xargs -P{scripts.cores} -n1 "{sys.executable}" >/dev/null'
    command = ["sh", "-c", inner, "sh", paths + "\n"]
    return time_command(command, scripts.folder, environment(scripts.places))


def run_notebooks(scripts: Scripts, program: str) -> tuple[float, float]:
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
    names = sorted(path.name for path in folder.glob("*.ipynb"))
    time_command([*CONSENT, program, "notebook", "add", *names], folder, paths)
    execute = [program, "project", "execute", "--executor", "local-parallel", "--timeout", "120"]
    cold = time_command(execute, folder, paths)
    count = len(list((folder / ".jupyter_cache" / "executed").iterdir()))
    if count != len(names):
        raise CommandError(f"jupyter-cache has run {count} notebooks of {len(names)}")
    warm = time_command(execute, folder, paths)
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
    """The version of jupyter-cache."""
    program = places.python_tool("jcache")
    return None if program is None else read_version([program, "--version"])
