"""One script on a worker of a Dask cluster.

Entry points: `run_job`, which a worker calls; `facts`, by which both sides know that a result here
is the result there.

1. What the worker has installed must be what the course is verified with; if not, it says what
   differs, and runs nothing.
2. The course's files are unpacked into a fresh folder, since scripts may write; the script runs
   there like everywhere else, and the folder goes.
3. What was printed to standard error names the files of the course as they are called at home.
"""

from __future__ import annotations

import io
import platform
import tempfile
import zipfile
from pathlib import Path

import msgspec
from msgspec.structs import replace

from coursebuild.core.model.results import ScriptJob, ScriptRun
from coursebuild.core.run.runner import run_scripts
from coursebuild.core.run.versions import engine_version, package_version, python_version


class Request(msgspec.Struct, frozen=True):
    """What to run, and what must be installed."""

    job: ScriptJob
    facts: tuple[tuple[str, str], ...]
    root: str
    """The course's folder at home."""


class Reply(msgspec.Struct, frozen=True):
    """What became of it: a run, or what is installed instead."""

    run: ScriptRun | None
    facts: tuple[tuple[str, str], ...]


def facts() -> tuple[tuple[str, str], ...]:
    """What a result depends on beside the course, by name."""
    return (
        ("Python", f"{platform.python_implementation()} {python_version()}"),
        ("machine", f"{platform.system()} {platform.machine()}"),
        ("coursebuild", package_version("coursebuild")),
        ("MuJoCo", engine_version()),
        ("NumPy", package_version("numpy")),
    )


def hold(archive: bytes) -> bytes:
    """The course's files, on a worker."""
    return archive


def run_job(archive: bytes, message: bytes) -> bytes:
    """Run one script.

    Args:
        archive: the course's files, as a zip file.
        message: a `Request` as JSON.

    Returns:
        A `Reply` as JSON.
    """
    request = msgspec.json.decode(message, type=Request)
    here = facts()
    if here != request.facts:
        return msgspec.json.encode(Reply(None, here))
    with tempfile.TemporaryDirectory(prefix="coursebuild-") as folder:
        root = Path(folder).resolve()
        with zipfile.ZipFile(io.BytesIO(archive)) as files:
            files.extractall(root)
        [run] = run_scripts(root, [request.job], parallel=1)
    return msgspec.json.encode(Reply(_at_home(run, str(root), request.root), here))


def _at_home(run: ScriptRun, here: str, home: str) -> ScriptRun:
    """The run as it would have been at home, but for files that are nowhere but here."""
    trace = run.trace
    if trace is not None and trace.outside and not trace.opaque:
        why = "it read files of another machine that are no part of the course"
        trace = replace(trace, outside=(), opaque=why)
    return replace(run, stderr=run.stderr.replace(here, home), trace=trace)
