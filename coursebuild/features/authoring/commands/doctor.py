"""`coursebuild doctor`: say what works on this machine, and how to mend what does not.

What can end a process, as a driver of a graphics card can, is tried in one of its own.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from msgspec import Struct

from coursebuild.cli.output import CLEAN, WRONG, style_of, write
from coursebuild.core.engine.memo import SIZE
from coursebuild.core.files.course_root import find_course_root
from coursebuild.core.files.errors import EffectError, UsageError
from coursebuild.core.files.locks import try_lock
from coursebuild.core.files.resources import Bundle, template_texts
from coursebuild.core.run.versions import engine_version, python_version
from coursebuild.features.lab.engines.browser import LabEngine
from coursebuild.report.terminal import GREEN, RED, YELLOW, Style, visible

EXAMPLES = """\
examples:
  coursebuild doctor                 in a course, or anywhere
"""
_SECONDS = 120
_STEP = """
import mujoco
model = mujoco.MjModel.from_xml_string("<mujoco><worldbody><light/></worldbody></mujoco>")
data = mujoco.MjData(model)
mujoco.mj_step(model, data)
"""
_DRAW = f"""{_STEP}
renderer = mujoco.Renderer(model, 32, 32)
renderer.update_scene(data)
renderer.render()
"""
_BACKENDS = ("egl", "osmesa")


class Probe(Struct, frozen=True):
    """Whether something works."""

    what: str
    ok: bool
    cure: str = ""
    needed: bool = True
    """Whether every course needs it."""


def declare(parser: argparse.ArgumentParser) -> None:
    """What can be said: nothing."""


def run(arguments: argparse.Namespace) -> int:
    """Try each, and print a line at once."""
    folder = Path(arguments.root or find_course_root(".") or ".").resolve()
    if not folder.is_dir():
        raise UsageError(f"there is no folder {arguments.root}")
    style, status = style_of(sys.stdout), CLEAN
    for find in (_python, _mujoco, _lab_engine, _fonts, _folder, _locks, _disk, _rendering):
        for found in find(folder):
            write(_line(found, style), CLEAN)
            if found.needed and not found.ok:
                status = WRONG
    return status


def _line(found: Probe, style: Style) -> str:
    word, colour = ("ok", GREEN) if found.ok else ("broken", RED) if found.needed else ("-", YELLOW)
    line = f"{style.paint(f'{word:<8}', colour)} {visible(found.what)}\n"
    return line if found.ok else f"{line}         help: {visible(found.cure)}\n"


def _python(_: Path) -> Iterator[Probe]:
    yield Probe(f"Python {python_version()} at {sys.executable}", True)


def _mujoco(_: Path) -> Iterator[Probe]:
    try:
        wrong = _fails(_STEP)
        what = f"MuJoCo {engine_version()}" + (f": {wrong}" if wrong else "")
        yield Probe(what, not wrong, "install coursebuild again, into an environment of its own")
    except EffectError as error:
        yield Probe(error.message, False, error.help)


def _lab_engine(_: Path) -> Iterator[Probe]:
    try:
        with LabEngine() as engine:
            engine.mistakes(())
            yield Probe(f"MuJoCo {engine.version} of the browser, in V8, for labs", True)
    except EffectError as error:
        yield Probe(error.message, False, error.help or "install coursebuild again")


def _fonts(_: Path) -> Iterator[Probe]:
    try:
        fonts = [name for name in Bundle() if name.endswith(".ttf")]
        templates = template_texts()
    except EffectError as error:
        yield Probe(error.message, False, error.help)
        return
    what = f"{len(fonts)} fonts and {len(templates)} templates of pages"
    yield Probe(what, bool(fonts and templates), "install coursebuild again")


def _folder(folder: Path) -> Iterator[Probe]:
    ok = os.access(folder, os.W_OK)
    cure = "give yourself the right to write there, or go to another folder"
    yield Probe(f"{folder} can be written" if ok else f"{folder} cannot be written", ok, cure)


def _locks(folder: Path) -> Iterator[Probe]:
    try:
        with tempfile.TemporaryFile(dir=folder) as file:
            ok = try_lock(file.fileno()) is not None
    except OSError:  # said already
        return
    what = "locks, by which two commands on one course wait for each other"
    cure = "use a disk of this machine, or run one command at a time"
    yield Probe(what if ok else f"no {what}", ok, cure, needed=False)


def _disk(folder: Path) -> Iterator[Probe]:
    free = shutil.disk_usage(folder).free
    cure = "make room, or let .coursebuild take less: `--cache-size 200M`"
    yield Probe(f"{free / (1 << 30):.1f} GiB free on the disk", free > SIZE, cure, needed=False)


def _rendering(_: Path) -> Iterator[Probe]:
    """Scripts can draw with `mujoco.Renderer`; pictures of labs need nothing of it."""
    chosen = os.environ.get("MUJOCO_GL")
    wrong = _fails(_DRAW)
    if not wrong:
        by = f" (MUJOCO_GL={chosen})" if chosen else ""
        yield Probe(f"offscreen rendering{by}, for scripts that use `mujoco.Renderer`", True)
        return
    works = next((name for name in _BACKENDS if not _fails(_DRAW, MUJOCO_GL=name)), "")
    cure = (
        f"set the environment variable MUJOCO_GL={works}"
        if works
        else (
            "install a driver of the graphics card, or a software renderer: on Debian and Ubuntu "
            "`apt install libosmesa6`, and set MUJOCO_GL=osmesa"
        )
    )
    yield Probe(f"no offscreen rendering: {wrong}", False, cure, needed=False)


def _fails(code: str, **environment: str) -> str:
    """The last line of what goes wrong when code runs in a process of its own; empty if nothing."""
    try:
        done = subprocess.run(
            [sys.executable, "-c", code],
            env=os.environ | environment,
            capture_output=True,
            timeout=_SECONDS,
        )
    except subprocess.TimeoutExpired:
        return f"it takes longer than {_SECONDS} s"
    lines = done.stderr.decode("utf-8", "replace").strip().splitlines()
    if done.returncode == 0:
        return ""
    return lines[-1] if lines else f"the process ended with status {done.returncode}"
