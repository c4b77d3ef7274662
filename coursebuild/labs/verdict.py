"""What a trial found, as diagnostics at the entries of the lesson.

Entry points: `trial_diagnostics(lab, trial)`, `parity_diagnostics(lab, parity)`, `code_diagnostic`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from coursebuild.diagnostics import Diagnostic, diagnose
from coursebuild.labs.compile import Entry, Piece
from coursebuild.labs.reply import Failure, Trial
from coursebuild.model import Lab
from coursebuild.source import Span

PARITY_RTOL = 1e-9
"""How far (relative) the two engines may be apart over the first second, unless a lab says."""

_RULES = {
    "throws": "lab-throws",
    "nan": "lab-value",
    "type": "lab-value",
    "warning": "lab-warning",
    "diverged": "lab-diverged",
    "expect": "lab-expect",
    "stopAt": "lab-expect",
    "timeout": "lab-timeout",
    "engine": "lab-engine",
}


@dataclass(frozen=True, slots=True)
class Parity:
    """A run of the browser's engine beside the native one."""

    steps: int
    timestep: float
    """s."""
    first: int | None
    """The first step after which the states differ; `None`: bit-identical."""
    relative: float
    """Largest difference relative to the largest number of the state, where it counts."""

    def within(self, rtol: float | None) -> bool:
        """Whether the difference is allowed."""
        return self.first is None or self.relative <= (PARITY_RTOL if rtol is None else rtol)

    def describe(self) -> str:
        """For people."""
        if self.first is None:
            return f"bit-identical to native MuJoCo over {self.steps} steps"
        return f"differs from native MuJoCo from step {self.first}, by {self.relative:.1e}"


def entry_span(lab: Lab, entry: Entry) -> Span:
    """Where an entry of a lab stands: the smallest one that is known."""
    match entry:
        case ("controls", int(i), *_) if i < len(lab.controls):
            return lab.controls[i].span.first_line()
        case ("readouts", int(i), *_) if i < len(lab.readouts):
            return lab.readouts[i].span.first_line()
        case ("plots", int(i), "traces", int(j), *_) if i < len(lab.plots):
            return lab.plots[i].traces[j].span.first_line()
        case ("plots", int(i), *_) if i < len(lab.plots):
            return lab.plots[i].span.first_line()
        case ("expect", int(i), *_) if i < len(lab.expect):
            return lab.expect[i].span.first_line()
        case _:
            return lab.span.first_line()


def _named(entry: Entry) -> str:
    """An entry in words: `controls[2].set`."""
    text = ""
    for part in entry:
        text += f"[{part}]" if isinstance(part, int) else f".{part}" if text else part
    return text or "the lab"


def code_diagnostic(piece: Piece, message: str) -> Diagnostic:
    """A piece of code that does not parse."""
    what = f"`{_named(piece.entry)}` is no JavaScript: {message}"
    return diagnose("lab-code", piece.span.first_line(), what, label=_short(piece.code))


def trial_diagnostics(lab: Lab, trial: Trial) -> tuple[Diagnostic, ...]:
    """Each failure of a trial, at its entry."""
    return tuple(_failure(lab, failure) for failure in trial.failures)


def _failure(lab: Lab, failure: Failure) -> Diagnostic:
    name = _named(failure.entry)
    when = "" if failure.time is None else f" at t = {failure.time:.6g} s"
    tried = f"while trying {failure.during}" if failure.during not in ("", "start") else ""
    message = failure.message.rstrip(".")
    match failure.kind:
        case "throws":
            text = f"`{name}` throws: {message}"
        case "nan" | "type":
            text = f"`{name}` {message}{when}"
        case "warning":
            text = f"MuJoCo warns{when}: {message}"
        case "diverged":
            text = f"the simulation diverges{when}: {message}"
        case "expect":
            text = f"the claim does not hold: `{name}` {message}"
        case _:
            text = message
    span = entry_span(lab, failure.entry)
    return diagnose(_RULES.get(failure.kind, "lab-throws"), span, text, label=tried)


def parity_diagnostics(lab: Lab, parity: Parity) -> Iterator[Diagnostic]:
    """A difference between the engines that is larger than allowed."""
    if parity.within(lab.verify_rtol):
        return
    time = (parity.first or 0) * parity.timestep
    allowed = PARITY_RTOL if lab.verify_rtol is None else lab.verify_rtol
    yield diagnose(
        "lab-parity",
        lab.span.first_line(),
        f"the browser's engine {parity.describe()} (t = {time:.6g} s), and {allowed:g} is allowed",
        help='if the motion is chaotic say how much is, in "verify": {"rtol": …, "seconds": …}',
    )


def _short(code: str) -> str:
    line = " ".join(code.split())
    return line if len(line) <= 60 else line[:59] + "…"
