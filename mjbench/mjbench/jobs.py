"""Measuring for another program: requests and answers as lines of JSON (`mjbench jobs`).

A request is an object with the key `job`, one of `JOBS`, and what that function takes. On standard
output it is answered by lines with one key each:

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
from collections.abc import Callable, Mapping, Sequence
from typing import IO, Any, Literal, get_type_hints

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
from mjbench.reports.diet_report import DietReport
from mjbench.reports.model_report import CaseReport, EngineReport, SceneReport
from mjbench.reports.records import (
    BENCH,
    DIET,
    ENGINES,
    STABILITY,
    Departure,
    case_departures,
    scene_departures,
)
from mjbench.reports.scene_report import ScenarioReport, SweepReport
from mjbench.reports.terminal import Style
from mjbench.text import AnyReport, report_text


class Facts(Struct, frozen=True):
    """What is here."""

    code: str
    """A hash of the code: other code may measure other figures."""
    machine: Machine
    pinned: Machine
    """The same where times are taken on a single processor."""
    problems: tuple[str, ...]


class EngineChoice(Struct, frozen=True):
    """Names of engines with the versions of their packages, and what is not installed."""

    engines: tuple[tuple[str, tuple[tuple[str, str], ...]], ...]
    remarks: tuple[str, ...]


def facts(_: Host) -> Facts:
    """Say what is here: code, machine, problems."""
    return Facts(code_digest(), this_machine(), this_machine(pinned=True), tuple(all_problems()))


def scenario(
    host: Host, *, subject: Subject, number: int, quick: bool = False, timed: bool = True
) -> ScenarioReport:
    """Measure a scenario by its number."""
    compiled_model = bench.compile_subject(subject, host, quick=quick)
    return bench.run_scenario(compiled_model, number, host, quick=quick, timed=timed)


def sweep(
    host: Host, *, subject: Subject, name: str, quick: bool = False, timed: bool = True
) -> SweepReport:
    """Measure a sweep."""
    compiled_model = bench.compile_subject(subject, host, quick=quick)
    return bench.run_sweep(compiled_model, name, host, quick=quick, timed=timed)


def join(
    host: Host,
    *,
    subject: Subject,
    scenarios: tuple[ScenarioReport, ...],
    sweeps: tuple[SweepReport, ...] = (),
    quick: bool = False,
    card: bool = False,
) -> SceneReport:
    """Make a report of parts; `card`: whether to say what the model is made of."""
    compiled_model = bench.compile_subject(subject, host, quick=quick)
    return bench.join_parts(compiled_model, scenarios, sweeps, host, quick=quick, card=card)


def case(_: Host, *, name: str) -> CaseReport:
    """Measure a hard case."""
    with one_processor():
        problem = all_problems()[name]
        return measure_case(problem, this_machine(pinned=True), time.thread_time_ns)


def choose_engines(_: Host, *, names: tuple[str, ...] = ()) -> EngineChoice:
    """Which engines are meant by names, or are installed."""
    engines, remarks = chosen_engines(names)
    return EngineChoice(tuple((e.name, e.versions) for e in engines), remarks)


def engines(
    host: Host, *, subject: Subject, names: tuple[str, ...], quick: bool = False
) -> EngineReport:
    """Measure a model in engines."""
    return measure_engines(subject, chosen_engines(names)[0], host, quick=quick)


def write(
    _: Host,
    *,
    bench: SceneReport | None = None,
    engines: EngineReport | None = None,
    diet: DietReport | None = None,
    cases: Sequence[CaseReport] = (),
) -> str:
    """The text of a file with a report of one of these kinds."""
    if bench is not None:
        return BENCH.encode(bench).decode()
    if engines is not None:
        return ENGINES.encode(engines).decode()
    if diet is not None:
        return DIET.encode(diet).decode()
    return STABILITY.encode(tuple(sorted(cases, key=lambda c: (c.case, c.name)))).decode()


def text(
    _: Host,
    *,
    bench: tuple[SceneReport, ...] = (),
    engines: tuple[EngineReport, ...] = (),
    diet: tuple[DietReport, ...] = (),
    cases: tuple[CaseReport, ...] = (),
    width: int = 100,
    colour: bool = False,
    command: str = "",
    declarations: str = "",
) -> str:
    """Reports of one kind in words, for a terminal.

    `command` looks at a model again, with `{}` for its name; `declarations` is the file that
    declares what is kept, the same way.
    """
    style = Style(width, colour)
    reports: tuple[AnyReport, ...] = (*bench, *engines, *cases, *diet)
    return "\n".join(report_text(r, style, command, declarations) for r in reports)


def compare(
    _: Host,
    *,
    recorded: SceneReport | None = None,
    measurement: SceneReport | None = None,
    bands: BenchTable | None = None,
    recorded_cases: tuple[CaseReport, ...] = (),
    measured_cases: tuple[CaseReport, ...] = (),
) -> tuple[Departure, ...]:
    """Compare what was recorded with what was measured."""
    if recorded is not None and measurement is not None:
        return scene_departures(recorded, measurement, bands or BenchTable())
    return case_departures(recorded_cases, measured_cases)


JOBS: dict[str, Callable[..., object]] = {
    "about": facts,
    "scenario": scenario,
    "sweep": sweep,
    "join": join,
    "case": case,
    "diet": diet.look_at,
    "choose-engines": choose_engines,
    "engines": engines,
    "write": write,
    "text": text,
    "compare": compare,
}


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
        try:
            pipe.say(result=answer(line, pipe))
        except CannotMeasureError as error:
            pipe.say(failure=Failure(error.message, error.help, error.place, error.cause))
        except DisagreementError as error:
            help = "neither is known to be right, so errors against them mean nothing"
            pipe.say(failure=Failure(str(error), help))
        except UnknownEngineError as error:
            pipe.say(failure=Failure(str(error)))


def answer(request: bytes, host: Host) -> object:
    """Do the job that a line asks for."""
    values = msgspec.json.decode(request)
    job = JOBS[values.pop("job")]
    forms = get_type_hints(job)
    return job(host, **{name: msgspec.convert(part, forms[name]) for name, part in values.items()})
