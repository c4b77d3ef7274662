"""Measuring for another program: requests and answers as lines of JSON (`mjbench jobs`).

A request is an object with the key `job` and what that job takes, see `Job` for all of them. On
standard output it is answered by lines with one key each:

- `tell`: what is measured now;
- `ask`: something that only the other program knows; it writes a line with the answer, see
  `Question`;
- `result`: what was asked for, or `failure`: why there is none. Either is the last line.

Errors of this program itself are on standard error, and end it. Files of bytes are Base64.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Mapping
from typing import IO, Any, Literal, TypeAlias

import msgspec
from msgspec import Struct

from mjbench import bench, diet
from mjbench.bench import CannotMeasureError, Subject
from mjbench.cases import DisagreementError, measure_case
from mjbench.declarations import BenchTable, Place
from mjbench.engines.engine_run import UnknownEngineError, chosen_engines, measure_engines
from mjbench.host import EXACT_SCRIPT, ExactRun, Host
from mjbench.machine import Machine, code_digest, one_processor, this_machine
from mjbench.problems import all_problems
from mjbench.reports.case_report import CaseReport
from mjbench.reports.diet_report import DietReport, Keep
from mjbench.reports.engine_report import EngineReport
from mjbench.reports.model_report import SceneReport
from mjbench.reports.records import (
    BENCH,
    DIET,
    ENGINES,
    STABILITY,
    case_departures,
    scene_departures,
)
from mjbench.reports.scene_report import ScenarioReport, SweepReport
from mjbench.reports.terminal import Style
from mjbench.text import AnyReport, report_text


class About(Struct, frozen=True, tag_field="job", tag="about"):
    """Ask what is here: code, machine, problems."""


class Facts(Struct, frozen=True):
    """The answer."""

    code: str
    """A hash of the code: other code may measure other figures."""
    machine: Machine
    pinned: Machine
    """The same where times are taken on a single processor."""
    problems: tuple[str, ...]


class Scenario(Struct, frozen=True, tag_field="job", tag="scenario"):
    """Measure a scenario by its number: a `ScenarioReport`."""

    subject: Subject
    number: int
    quick: bool = False
    timed: bool = True


class Sweep(Struct, frozen=True, tag_field="job", tag="sweep"):
    """Measure a sweep: a `SweepReport`."""

    subject: Subject
    name: str
    quick: bool = False
    timed: bool = True


class Join(Struct, frozen=True, tag_field="job", tag="join"):
    """Make a `SceneReport` of parts."""

    subject: Subject
    scenarios: tuple[ScenarioReport, ...]
    sweeps: tuple[SweepReport, ...] = ()
    quick: bool = False
    card: bool = False
    """Whether to say what the model is made of."""


class Case(Struct, frozen=True, tag_field="job", tag="case"):
    """Measure a hard case: a `CaseReport`."""

    name: str


class Diet(Struct, frozen=True, tag_field="job", tag="diet"):
    """Look for what a model could do without: a `DietResult`."""

    subject: Subject
    readers: tuple[diet.ReaderSource, ...] = ()
    modules: frozenset[str] = frozenset()
    keeps: tuple[Keep, ...] = ()
    locked: Mapping[str, str] = {}
    only: tuple[str, ...] = ()
    """The kinds of findings to look for; all if none is named."""
    quick: bool = False
    rerun: bool = False
    """Whether the other program is asked for what it runs with the changed files."""


class ChooseEngines(Struct, frozen=True, tag_field="job", tag="choose-engines"):
    """Ask which engines are meant by names, or are installed: an `EngineChoice`."""

    names: tuple[str, ...] = ()


class EngineChoice(Struct, frozen=True):
    """Names of engines with the versions of their packages, and what is not installed."""

    engines: tuple[tuple[str, tuple[tuple[str, str], ...]], ...]
    remarks: tuple[str, ...]


class Engines(Struct, frozen=True, tag_field="job", tag="engines"):
    """Measure a model in engines: an `EngineReport`."""

    subject: Subject
    names: tuple[str, ...]
    quick: bool = False


class Write(Struct, frozen=True, tag_field="job", tag="write"):
    """Ask for the text of a file with a report of one of these kinds."""

    bench: SceneReport | None = None
    engines: EngineReport | None = None
    diet: DietReport | None = None
    cases: tuple[CaseReport, ...] | None = None


class Text(Struct, frozen=True, tag_field="job", tag="text"):
    """Ask for reports of one kind in words, for a terminal."""

    bench: tuple[SceneReport, ...] = ()
    engines: tuple[EngineReport, ...] = ()
    diet: tuple[DietReport, ...] = ()
    cases: tuple[CaseReport, ...] = ()
    width: int = 100
    colour: bool = False
    command: str = ""
    """What looks at a model again, with `{}` for its name."""
    declarations: str = ""
    """The file that declares what is kept, the same way."""


class Compare(Struct, frozen=True, tag_field="job", tag="compare"):
    """Compare what was recorded with what was measured: a list of `Departure`."""

    recorded: SceneReport | None = None
    measured: SceneReport | None = None
    bands: BenchTable = BenchTable()
    recorded_cases: tuple[CaseReport, ...] = ()
    measured_cases: tuple[CaseReport, ...] = ()


Job: TypeAlias = (
    About | Scenario | Sweep | Join | Case | Diet | ChooseEngines | Engines | Write | Text | Compare
)


class Question(Struct, frozen=True, omit_defaults=True):
    """What is asked; the answer has the same key with `output`, `speed` or `difference` in it."""

    exact: tuple[str, ...] = ()
    """Run a script of Python with a file and a query: how it ended (`ExactRun`)."""
    seconds: float = 0.0
    """Processor time that it may take."""
    browser: tuple[int | None, float] | None = None
    """How fast does the model run in a browser, from this keyframe for so many seconds?"""
    rerun: Mapping[str, bytes] | None = None
    """Which program prints something else with these files? Its name, or nothing."""


class Failure(Struct, frozen=True):
    """Why there is no result."""

    message: str
    help: str = ""
    place: Place | None = None
    """Where in the model's files; `None` where it is not about these."""
    cause: Literal["scenario", "model", ""] = ""
    """What is wrong: the model, or what is declared beside it."""


class Pipe:
    """The other program."""

    def __init__(self, requests: IO[bytes], answers: IO[bytes]) -> None:
        self._requests, self._answers = requests, answers

    def say(self, **line: object) -> None:
        """Write a line."""
        self._answers.write(msgspec.json.encode(line) + b"\n")
        self._answers.flush()

    def tell(self, text: str) -> None:
        """Say what is measured now."""
        self.say(tell=text)

    def _ask(self, question: Question, form: Any) -> Any:
        self.say(ask=question)
        line = self._requests.readline()
        if not line:
            raise EOFError("the program that asked has gone")
        return msgspec.json.decode(line, type=form)

    def run_exact(self, path: str, query: str, seconds: float) -> ExactRun:
        """Let the other program run `exact.py`, where and as it runs code."""
        question = Question(exact=(EXACT_SCRIPT, path, query), seconds=seconds)
        run: ExactRun = self._ask(question, ExactRun)
        return run

    def browser_speed(self, keyframe: int | None, duration: float) -> float | None:
        """How fast the model runs in a browser."""
        speed: float | None = self._ask(Question(browser=(keyframe, duration)), float | None)
        return speed

    def rerun(self, files: Mapping[str, bytes]) -> str:
        """Which program prints something else with these files."""
        return str(self._ask(Question(rerun=files), str))


def serve() -> None:
    """Answer requests until the input ends."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what MuJoCo or an engine prints is no answer
    pipe = Pipe(sys.stdin.buffer, answers)
    while line := sys.stdin.buffer.readline():
        job = msgspec.json.decode(line, type=Job)
        try:
            pipe.say(result=answer(job, pipe))
        except CannotMeasureError as error:
            pipe.say(failure=Failure(error.message, error.help, error.place, error.cause))
        except DisagreementError as error:
            help = "neither is known to be right, so errors against them mean nothing"
            pipe.say(failure=Failure(str(error), help))
        except UnknownEngineError as error:
            pipe.say(failure=Failure(str(error)))


def answer(job: Job, host: Host) -> object:
    """Do a job."""
    match job:
        case About():
            return Facts(
                code_digest(), this_machine(), this_machine(pinned=True), tuple(all_problems())
            )
        case Scenario():
            compiled_model = bench.compile_subject(job.subject, host, quick=job.quick)
            return bench.run_scenario(
                compiled_model, job.number, host, quick=job.quick, timed=job.timed
            )
        case Sweep():
            compiled_model = bench.compile_subject(job.subject, host, quick=job.quick)
            return bench.run_sweep(compiled_model, job.name, host, quick=job.quick, timed=job.timed)
        case Join():
            compiled_model = bench.compile_subject(job.subject, host, quick=job.quick)
            return bench.join_parts(
                compiled_model, job.scenarios, job.sweeps, host, quick=job.quick, card=job.card
            )
        case Case():
            with one_processor():
                problem = all_problems()[job.name]
                return measure_case(problem, this_machine(pinned=True), time.thread_time_ns)
        case Diet():
            return diet.look_at(
                job.subject,
                host,
                job.readers,
                modules=job.modules,
                keeps=job.keeps,
                locked=job.locked,
                only=job.only,
                quick=job.quick,
                rerun=job.rerun,
            )
        case ChooseEngines():
            engines, remarks = chosen_engines(job.names)
            return EngineChoice(tuple((e.name, e.versions) for e in engines), remarks)
        case Engines():
            engines, _ = chosen_engines(job.names)
            return measure_engines(job.subject, engines, host, quick=job.quick)
        case Write():
            return _file_text(job)
        case Text():
            return _words(job)
        case Compare():
            if job.recorded is not None and job.measured is not None:
                return scene_departures(job.recorded, job.measured, job.bands)
            return case_departures(job.recorded_cases, job.measured_cases)


def _file_text(job: Write) -> str:
    if job.bench is not None:
        data = BENCH.encode(job.bench)
    elif job.engines is not None:
        data = ENGINES.encode(job.engines)
    elif job.diet is not None:
        data = DIET.encode(job.diet)
    else:
        cases = sorted(job.cases or (), key=lambda case: (case.case, case.name))
        data = STABILITY.encode(tuple(cases))
    return data.decode()


def _words(job: Text) -> str:
    style = Style(job.width, job.colour)
    reports: tuple[AnyReport, ...] = (*job.bench, *job.engines, *job.cases, *job.diet)
    return "\n".join(report_text(r, style, job.command, job.declarations) for r in reports)
