"""Measures through mjbench, a program of its own, in a process that ends with its user.

It answers jobs as lines of JSON, see `mjbench/jobs.py`. On the way it asks what only a course
knows: what the file of an exact motion prints, how fast a model runs in the browser's engine, which
of the course's scripts and labs print something else with changed files.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import IO, Literal, Self

import msgspec
from msgspec import Raw, Struct

from coursebuild.api import (
    Diagnostic,
    EffectError,
    Outcome,
    ScriptJob,
    ScriptServer,
    Source,
    Span,
    diagnose,
    gate,
)
from coursebuild.core.files.errors import require
from coursebuild.core.model.results import Machine
from coursebuild.core.model.scenarios import exact_file
from coursebuild.core.run.mjcf import existing_files
from coursebuild.pipeline.scenes import CourseScene

_SECONDS = 20.0
"""Limit of a run in the browser's engine, in seconds of processor time."""


class Facts(Struct, frozen=True):
    """What mjbench is here: all that its figures depend on beside the models."""

    code: str
    machine: Machine
    pinned: Machine
    problems: tuple[str, ...]


class KeyPlace(Struct, frozen=True):
    """A file, and in TOML the keys that lead to a value."""

    path: str
    keys: tuple[str | int, ...] = ()


class Failure(Struct, frozen=True):
    """Why there is no result."""

    message: str
    help: str = ""
    place: KeyPlace | None = None
    """`None` where it is not about a model's files."""
    cause: Literal["scenario", "model", ""] = ""
    """What is wrong: the model, or what is declared beside it."""


class FailedJobError(Exception):
    """mjbench gives no result."""

    def __init__(self, failure: Failure) -> None:
        super().__init__(failure.message)
        self.failure = failure


class _Question(Struct, frozen=True):
    exact: tuple[str, ...] = ()
    seconds: float = 0.0
    browser: tuple[int | None, float] | None = None
    rerun: Mapping[str, bytes] | None = None


class _Line(Struct, frozen=True):
    tell: str | None = None
    ask: _Question | None = None
    failure: Failure | None = None
    result: Raw = Raw(b"")


class Mjbench:
    """The process, started with the first job."""

    def __init__(self, root: Path, purpose: str) -> None:
        """`purpose`: the command that needs it."""
        self.tell: Callable[[str], None] = lambda text: None
        self.rerun: Callable[[Mapping[str, bytes]], str] = lambda files: ""
        """Names what prints something else with changed files."""
        self._root = root
        self._purpose = purpose
        self._scene: CourseScene | None = None
        self._process: gate.Process | None = None
        self._errors: IO[bytes] | None = None

    def __enter__(self) -> Self:
        require("mjbench", "measure", self._purpose)
        return self

    def __exit__(self, *_: object) -> None:
        process, self._process = self._process, None
        if process is not None:
            gate.end(process)
        if self._errors is not None:
            self._errors.close()

    def facts(self) -> Facts:
        """Say what is here."""
        return msgspec.json.decode(self.do("about"), type=Facts)

    def do(self, job: str, scene: CourseScene | None = None, **values: object) -> bytes:
        """Do a job, about a scene if it is about one; return the JSON of its result.

        Raises:
            FailedJobError: it says why there is none.
            EffectError: mjbench is not installed, or it ended.
        """
        self._scene = scene
        subject = {} if scene is None else {"subject": subject_of(self._root, scene)}
        process = self._process or self._start()
        self._send(process, {"job": job, **subject, **values})
        assert process.stdout is not None
        while text := process.stdout.readline():
            line = msgspec.json.decode(text, type=_Line)
            if line.tell is not None:
                self.tell(line.tell)
            elif line.ask is not None:
                self._send(process, self._answer(line.ask))
            elif line.failure is not None:
                raise FailedJobError(line.failure)
            else:
                return bytes(line.result)
        raise EffectError(f"the process of mjbench ended: {self._last_words(process)}")

    def _last_words(self, process: gate.Process) -> str:
        status = process.wait()
        assert self._errors is not None
        self._errors.seek(0)
        words = gate.last_line(self._errors.read())
        self.__exit__()
        return words or f"with status {status}"

    def _start(self) -> gate.Process:
        python_path = os.environ.get("PYTHONPATH", "")  # where the user has further packages
        self._errors = tempfile.TemporaryFile()  # noqa: SIM115  # it is closed with the process
        self._process = gate.start(
            gate.module_command("mjbench", "jobs", python_path=python_path),
            gate.environment(*gate.COMPUTING, TMPDIR=gate.working_folder()),
            stdin=gate.PIPE,
            stdout=gate.PIPE,
            stderr=self._errors,
        )
        return self._process

    def _send(self, process: gate.Process, value: object) -> None:
        assert process.stdin is not None
        try:
            process.stdin.write(msgspec.json.encode(value) + b"\n")
            process.stdin.flush()
        except BrokenPipeError:
            pass  # it ended, which reading will show

    def _answer(self, question: _Question) -> object:
        if question.rerun is not None:
            return self.rerun(question.rerun)
        if question.browser is not None:
            return self._browser_speed(*question.browser)
        script, *arguments = question.exact
        job = ScriptJob(os.path.relpath(script, self._root), tuple(arguments), question.seconds, ())
        with ScriptServer() as server:
            (run,) = server.run(self._root, (job,), parallel=1)
        failure = ""
        if run.outcome is Outcome.TIMEOUT:
            failure = f"it takes longer than {question.seconds:g} s"
        elif run.outcome is not Outcome.OK:
            failure = gate.last_line(run.stderr.encode()) or run.outcome.value
        return {"output": run.stdout, "failure": failure}

    def _browser_speed(self, key: int | None, duration: float) -> float | None:
        from coursebuild.features.lab.engines.browser import real_time_factor

        assert self._scene is not None
        run = duration, self._scene.facts.timestep
        return real_time_factor(self._root, self._scene.model.source, key, run, _SECONDS)


def subject_of(root: Path, scene: CourseScene) -> dict[str, object]:
    """A scene as mjbench is told of it: texts as they were read, so that all fits its digest."""
    source, table = scene.model.source, scene.declarations.source
    exact, is_declared = exact_file(scene.name), table.path != source.path
    files = (root / path for path in existing_files(root, source.path, source.text))
    return {
        "folder": str(root),
        "path": source.path,
        "mjcf": source.text,
        "name": scene.name,
        "digest": scene.digest,
        "declarations_path": table.path if is_declared else "",
        "declarations": table.text if is_declared else "",
        "exact": exact if (root / exact).is_file() else "",
        "parts": sum(path.stat().st_size for path in files),
    }


def diagnostic_of(failure: Failure, scene: CourseScene) -> Diagnostic:
    """What mjbench says of a model, at its place in the course."""
    place = failure.place or KeyPlace(scene.model.source.path)
    rule = "model-error" if failure.cause == "model" else "scenario-model"
    return diagnose(rule, _span(place, scene), failure.message, help=failure.help)


def _span(place: KeyPlace, scene: CourseScene) -> Span:
    declarations, model = scene.declarations, scene.model.source
    sources = {source.path: source for source in (model, declarations.source)}
    match place.keys:
        case ("scenario", int(number)):
            return declarations.scenarios[number].span
        case ("scenario", int(number), str(field)):
            return declarations.scenarios[number].place(field)
        case ("sweep", int(number), _, str(parameter)):
            variations = declarations.sweeps[number].variations
            return next(part.span for part in variations if part.parameter == parameter)
        case _:
            return sources.get(place.path, Source(place.path, "")).span(0, 0)
