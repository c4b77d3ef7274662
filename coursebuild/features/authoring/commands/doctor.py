"""`coursebuild doctor`: check this machine, and say how to fix what does not work.

What can kill a process, as a driver of a graphics card can, is tried in a process of its own.
"""

from __future__ import annotations

import argparse
import os
import re
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from msgspec import Struct

from coursebuild.api import CLEAN, FAILURE, EffectError, UsageError, gate, write
from coursebuild.core.files.course_root import find_course_root
from coursebuild.core.files.errors import lacking
from coursebuild.core.files.locks import try_lock
from coursebuild.core.files.trust import FOLDER, find_store, store_key
from coursebuild.core.run.environments import find_environment, prepare_environment
from coursebuild.core.run.sandbox import examine_sandbox
from coursebuild.core.run.script_environment import engine_version, python_version
from coursebuild.core.text.characters import printable
from coursebuild.features.lab.engines.browser import LabEngine
from coursebuild.features.lab.engines.native import LAB_ENGINE
from coursebuild.pipeline.arguments import style_of
from coursebuild.pipeline.options import Progress
from coursebuild.report.text import GREEN, RED, YELLOW
from coursebuild.report.values import plural

EXAMPLES = """\
examples:
  coursebuild doctor                     in a course, or anywhere
  coursebuild doctor --install-engine    before `check --sandbox`
"""
_SECONDS = 120
_STEP = """
import mujoco
model = mujoco.MjModel.from_xml_string("<mujoco><worldbody><light/></worldbody></mujoco>")
data = mujoco.MjData(model)
mujoco.mj_step(model, data)
"""
_DRAW = f"""{_STEP}
import os, threading
barrier = threading.Barrier(os.cpu_count() + 3)
for _ in range(barrier.parties - 1):
    threading.Thread(target=barrier.wait, daemon=True).start()
barrier.wait()
renderer = mujoco.Renderer(model, 32, 32)
renderer.update_scene(data)
renderer.render()
"""
_PERMIT = "get permission to write there, or use another folder"
_BACKENDS = ("egl", "osmesa")


class Probe(Struct, frozen=True):
    """Whether something works, and what to do if not."""

    text: str
    ok: bool
    cure: str = ""


def declare(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    help = "only install the MuJoCo of labs where another one is installed, for `--sandbox`"
    parser.add_argument("--install-engine", action="store_true", help=help)


def run(arguments: argparse.Namespace) -> int:
    """Make each probe, and print its line at once; the last line says what the status says."""
    folder = Path(arguments.root or find_course_root(".") or ".").resolve()
    if not folder.is_dir():
        raise UsageError(f"there is no folder {arguments.root}")
    if arguments.install_engine:
        place = sys.executable
        if engine_version() != LAB_ENGINE:
            place = prepare_environment(folder, LAB_ENGINE, Progress().say, locked=True).python
        return write(f"MuJoCo {LAB_ENGINE}, for labs, is installed for {printable(place)}\n", CLEAN)
    style, faults = style_of(sys.stdout), 0
    required = {
        "MuJoCo": _engines,
        "labs": _lab_engine,
        "the folder": _folder,
    }
    optional = {
        "kept results": _store,
        "locks": _locks,
        "offscreen rendering": _rendering,
        "`--sandbox`": _sandbox,
    }
    for subject, make_probes in {**required, **optional}.items():
        for probe in _finish(subject, make_probes(folder)):
            word, colour = ("broken", RED) if subject in required else ("-", YELLOW)
            if probe.ok:
                word, colour = "ok", GREEN
            line = f"{style.paint(f'{word:<8}', colour)} {printable(probe.text)}\n"
            if probe.cure and not probe.ok:
                line += f"         help: {printable(probe.cure)}\n"
            if write(line, CLEAN):
                return FAILURE
            faults += subject in required and not probe.ok
    verdict = "all that every course needs works"
    if faults:
        verdict = f"broken: {plural(faults, 'thing')} that every course needs"
    return write(
        f"\n{style.paint(verdict, RED if faults else GREEN)}\n", FAILURE if faults else CLEAN
    )


def _finish(subject: str, probes: Iterator[Probe]) -> Iterator[Probe]:
    """Make all probes: what cannot be tried does not work."""
    try:
        yield from probes
    except (EffectError, MemoryError, OSError, RuntimeError) as error:
        lack = error if isinstance(error, EffectError) else lacking(error)
        if lack is None:
            raise
        yield Probe(f"{subject}: {lack.message}", False, lack.help)


def _engines(_: Path) -> Iterator[Probe]:
    yield Probe(f"Python {python_version()} at {sys.executable}", True)
    error_line = _try_code(_STEP)
    text = f"MuJoCo {engine_version()}" + (f": {error_line}" if error_line else "")
    yield Probe(text, not error_line, "install coursebuild again, into an environment of its own")


def _lab_engine(folder: Path) -> Iterator[Probe]:
    """Probe the engine of labs, and native MuJoCo of the same version, which compiles for it."""
    with LabEngine() as engine:
        engine.check_code(())
        yield Probe(f"MuJoCo {engine.version} of the browser, in V8, for labs", True)
    if engine_version() == LAB_ENGINE:
        return
    environment = find_environment(folder, LAB_ENGINE, locked=True)
    place = ": it will be installed when a lab is first tried, or by `doctor --install-engine`"
    if not environment.fault():
        place = f" in {environment.prefix}"
    yield Probe(f"native MuJoCo {LAB_ENGINE} for labs{place}", True)


def _folder(folder: Path) -> Iterator[Probe]:
    ok = os.access(folder, os.W_OK)
    yield Probe(f"{folder} can be written" if ok else f"{folder} cannot be written", ok, _PERMIT)


def _store(folder: Path) -> Iterator[Probe]:
    place, reason = find_store(str(folder))
    if not reason:
        folder = next(path for path in (Path(place), *Path(place).parents) if path.exists())
        ok = os.access(folder, os.W_OK)
        verb = "are" if ok else "cannot be"
        yield Probe(f"results {verb} kept in {place}", ok, _PERMIT)
    elif not store_key(str(folder)):
        cure = "set HOME, XDG_STATE_HOME or COURSEBUILD_STORE_KEY"
        yield Probe("nothing is kept: there is no place for your key", False, cure)
    else:
        yield Probe(
            f"{FOLDER} {reason}; results are kept in {place}",
            False,
            f"remove {folder / FOLDER}",
        )


def _locks(folder: Path) -> Iterator[Probe]:
    try:
        with tempfile.TemporaryFile(dir=folder) as file:
            ok = try_lock(file.fileno()) is not None
    except OSError:  # `_folder` reports it
        return
    text = "locks, with which two commands on one course wait for each other"
    yield Probe(text if ok else f"no {text}", ok, "use a local disk, or run one command at a time")


def _rendering(_: Path) -> Iterator[Probe]:
    """Probe drawing with `mujoco.Renderer`, which only scripts use: pictures of labs do not."""
    backend = os.environ.get("MUJOCO_GL")
    error_line = _try_code(_DRAW)
    if not error_line:
        suffix = f" (MUJOCO_GL={backend})" if backend else ""
        yield Probe(f"offscreen rendering{suffix}, for scripts that use `mujoco.Renderer`", True)
        return
    works = next((name for name in _BACKENDS if not _try_code(_DRAW, MUJOCO_GL=name)), "")
    cure = (
        f"set the environment variable MUJOCO_GL={works}"
        if works
        else (
            "install a driver of the graphics card, or a software renderer: on Debian and Ubuntu "
            "`apt install libosmesa6`, and set MUJOCO_GL=osmesa"
        )
    )
    yield Probe(f"no offscreen rendering: {error_line}", False, cure)


def _sandbox(folder: Path) -> Iterator[Probe]:
    """Probe the parts of the sandbox, up to the first that lacks."""
    _, parts = examine_sandbox(folder)
    for part in parts:
        text = f"`--sandbox` {part.problem}" if part.problem else f"{part.name}, for `--sandbox`"
        yield Probe(text, not part.problem, part.help)


def _try_code(code: str, **environment: str) -> str:
    variables = gate.environment(*gate.DESKTOP, OPENBLAS_NUM_THREADS="1", **environment)
    try:
        trial = gate.finish(gate.python_command("-c", code), variables, seconds=_SECONDS)
    except TimeoutError as error:
        return str(error)
    if trial.status == 0:
        return ""
    line = trial.last_line()
    number = re.search(r"\[Errno (\d+)\]", line)
    failure = OSError(int(number[1]), "") if number else RuntimeError(line.rpartition(": ")[2])
    if lacking(failure):
        raise failure
    return line or f"the process ended with status {trial.status}"
