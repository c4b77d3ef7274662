"""Trials of labs without an engine: the page's own code in V8, held against NumPy and SciPy.

Tried are the controls as they start, each at its ends, and what claims and the goal set. Curves
must be finite, claims hold, the goal be reached by what its author says and by nothing less.
"""

from __future__ import annotations

import contextlib
import json
import math
import re
import time
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import msgspec
from msgspec import Struct

from coursebuild.api import Course, Diagnostic, Recording, diagnose, did_you_mean, find_blocks
from coursebuild.core.files.errors import require
from coursebuild.core.run.v8 import LimitError, ScriptError, V8Engine
from coursebuild.features.lab.engines.native import EQUATION_TRIAL, asset_path
from coursebuild.features.lab.equations import reference
from coursebuild.features.lab.model import PLOT, Entry, Lab

_MOST_POINTS = 500
_CHAOS = (
    "where small differences grow, say how far SciPy may be off, and up to where: "
    "`verify = {rtol = …, until = …}`"
)
_FAILURES = {
    "value": ("lab-diverged", "the solution has no finite {name} after {t}", ""),
    "blowup": ("lab-diverged", "the solution does not go on after {t}", ""),
    "steps": (
        "lab-endless",
        "the solution takes more than 20,000 steps to reach {t}",
        "the equations may be stiff, or their times too different: end sooner, or leave the "
        "fastest motion out",
    ),
    "events": (
        "lab-endless",
        "the event happens without end, up to {t}",
        "end the run before: `stop` with a condition, as `abs(v) < 0.01`",
    ),
}
"""Rule, text and help of each way in which a solution ends too soon."""
_NEVER = "the event never happens, whatever is tried"
_NEVER_HELP = (
    "a sign may be wrong, or the end too early; otherwise let a claim of `expect` set controls by "
    "which it happens"
)
_CLAIM_HELP = "if that is intended, claim so: `expect` with `diverges`"


class CurveFinding(Struct, frozen=True):
    """What a trial found, at an entry of the lab."""

    rule: str
    entry: Entry
    message: str
    label: str = ""
    help: str = ""

    def diagnostic(self, lab: Lab) -> Diagnostic:
        """Return it at its place in the lesson."""
        place = lab.place(self.entry)
        return diagnose(self.rule, place, self.message, label=self.label, help=self.help)


class EquationReply(Struct, frozen=True):
    """The result of a trial."""

    findings: tuple[CurveFinding, ...]
    tried: int = 0
    difference: float = 0.0
    """The largest, relative, from NumPy and SciPy."""
    start: reference.CurveRun | None = None
    seconds: float = 0.0
    timestamp: int = 0
    lasting: bool = True

    @property
    def reach(self) -> list[tuple[float, float] | None]:
        """The least and the greatest value of each curve as the lab starts; `None`: it has none."""
        plots = [] if self.start is None or self.start.failure is not None else self.start.plots
        lines = ([y for y in line if y is not None] for plot in plots for line in plot["traces"])
        return [(min(line), max(line)) if line else None for line in lines]

    def describe(self, kind: str) -> tuple[str, dict[str, str]]:
        """The key of an interface text that describes the comparison, and its values."""
        library = "NumPy" if kind == PLOT else "SciPy"
        values = {"library": library, "difference": f"{self.difference:.0e}"}
        return ("lab.parity.library", values) if self.start is not None else ("", {})


class EquationEngine(V8Engine):
    """The page's code for labs without an engine."""

    def __init__(self, memory: int) -> None:
        super().__init__(memory, lambda: (asset_path(EQUATION_TRIAL),))

    def run(self, request: dict[str, Any], seconds: float) -> list[reference.CurveRun]:
        """Run the attempts of a lab; those that do not end raise `LimitError` or `ScriptError`."""
        isolate = self._running_isolate()
        try:
            text = isolate.call("tryCurves", json.dumps(request), seconds)
        except (LimitError, ScriptError):
            self.close()
            raise
        return msgspec.convert(json.loads(text), list[reference.CurveRun])


class _Attempt(Struct, frozen=True):
    values: tuple[float, ...]
    description: str = ""
    entry: Entry = ()
    changed: frozenset[str] = frozenset()
    """Labels of the controls that are not as they start."""
    claims: tuple[int, ...] = ()
    is_goal: bool = False


def _attempts(config: Mapping[str, Any]) -> list[_Attempt]:
    """List what is tried: the start, each control by itself, what claims and the goal set."""
    controls = config["controls"]
    start = tuple(control["value"] for control in controls)
    attempts = {start: _Attempt(start)}

    def add(values: tuple[float, ...], entry: Entry) -> _Attempt:
        pairs = zip(controls, zip(values, start, strict=True), strict=True)
        changed = {control["label"]: value for control, (value, old) in pairs if value != old}
        text = ", ".join(f"{label} = {value:g}" for label, value in changed.items())
        return attempts.setdefault(values, _Attempt(values, text, entry, frozenset(changed)))

    for i, control in enumerate(controls):
        options = [value for _, value in control["options"]]
        for value in options or (control["min"], control["max"]):
            add((*start[:i], value, *start[i + 1 :]), ("controls", i))
    for i, claim in enumerate(config["expect"]):
        attempt = add(tuple(claim["values"]), ("expect", i))
        claims_of = (*attempt.claims, i)
        attempts[attempt.values] = msgspec.structs.replace(attempt, claims=claims_of)
    if config["goal"] is not None:
        attempt = add(tuple(config["goal"]["values"]), ("goal", "after"))
        attempts[attempt.values] = msgspec.structs.replace(attempt, is_goal=True)
    return list(attempts.values())


def add_points(config: dict[str, Any], course: Course) -> Iterator[CurveFinding]:
    """Put the numbers that scripts have printed into the data of a lab; yield what is missing."""
    for i, plot in enumerate(config["plots"]):
        points = plot["points"]
        if points is None:
            continue
        outputs = {
            recording.script: recording.body_span.text
            for document in course.documents
            for recording in find_blocks(document, Recording)
            if recording.script is not None
        }
        points["data"] = []
        entry: Entry = ("plots", i, "points", "script")
        if points["script"] not in outputs:
            message = f"no script `{points['script']}` has a recorded output"
            help = did_you_mean(points["script"], outputs)
            yield CurveFinding("lab-name", entry, message, help=help)
            continue
        for line in outputs[points["script"]].splitlines():
            words = re.split(r"[\s|,;]+", line.strip(" |").replace("\u2212", "-"))
            with contextlib.suppress(ValueError, IndexError):
                pair = [float(words[points[name] - 1]) for name in ("x", "y")]
                if config["axis"]["min"] <= pair[0] <= config["axis"]["max"]:
                    points["data"].append(pair)
        points["data"] = points["data"][:_MOST_POINTS]
        if not points["data"]:
            columns = f"columns {points['x']} and {points['y']}"
            message = f"the output of `{points['script']}` has no numbers of the axis in {columns}"
            yield CurveFinding("lab-points", entry, message)
        elif all(abs(y) <= points["within"] for _, y in points["data"]):
            message = "`within` is not less than any of these numbers, so a curve of 0 would do"
            yield CurveFinding("lab-points", (*entry[:-1], "within"), message)


def run_trial(engine: EquationEngine, config: dict[str, Any], seconds: float) -> EquationReply:
    """Try a lab, whose result depends on nothing but its data and the tool."""
    if config["states"]:
        require("scipy", "measure", "a trial of a lab's equations")
    attempts, patience = _attempts(config), time.thread_time() + seconds
    marks = [
        (i, plot["traces"][0]["value"], *pair)
        for i, plot in enumerate(config["plots"])
        for pair in (plot["points"] or {"data": ()})["data"]
    ]
    request = {
        "config": config,
        "attempts": [
            {
                "values": a.values,
                "claims": [
                    (config["expect"][i]["value"] or [0.0], config["expect"][i]["at"])
                    for i in a.claims
                ]
                + ([] if a.changed else [(program, x) for _, program, x, _ in marks]),
            }
            for a in attempts
        ],
    }
    try:
        runs = engine.run(request, seconds)
    except LimitError as error:
        finding = CurveFinding("lab-timeout", (), f"trying the lab {error}")
        return EquationReply((finding,), lasting=False)
    except ScriptError as error:
        reason = str(error).splitlines()[0]
        return EquationReply(
            (CurveFinding("lab-engine", (), f"the trial failed: {reason}"),), lasting=False
        )
    findings: dict[tuple[str, Entry], CurveFinding] = {}
    worst = 0.0
    for attempt, run in zip(attempts, runs, strict=True):
        mistakes = list(_check_run(config, attempt, run))
        if not mistakes:
            comparison, entry = _compare(config, attempt, run, patience)
            mistakes = list(_check_comparison(config, comparison, entry))
            worst = worst if mistakes else max(worst, comparison.difference)
        if not attempt.changed:
            values = run.claims[len(attempt.claims) :]
            mistakes += _check_points(config, zip(marks, values, strict=True))
        for finding in mistakes:
            label = f"while trying: {attempt.description}" if attempt.description else ""
            labelled = msgspec.structs.replace(finding, label=label)
            findings.setdefault((finding.rule, finding.entry), labelled)
    happened = {event["index"] for run in runs for event in run.events}
    for i in range(0 if findings else len(config["events"])):
        if i not in happened:
            finding = CurveFinding("lab-endless", ("events", i, "when"), _NEVER, help=_NEVER_HELP)
            findings[finding.rule, finding.entry] = finding
    return EquationReply(tuple(findings.values()), len(attempts), worst, runs[0])


def _check_points(
    config: Mapping[str, Any], pairs: Iterable[tuple[tuple[int, Any, float, float], float | None]]
) -> Iterator[CurveFinding]:
    """Report the printed number of each plot that is farthest from its curve, if it is too far."""
    worst: dict[int, tuple[float, str]] = {}
    for (i, _, x, y), value in pairs:
        points, at = config["plots"][i]["points"], _place(config, x)
        distance = math.inf if value is None else abs(value - y)
        if distance > max(points["within"], worst.get(i, (0.0, ""))[0]):
            curve = "no value" if value is None else f"{value:.6g}"
            text = f"`{points['script']}` printed {y:.6g} at {at}, where the curve has {curve}"
            worst[i] = distance, text
    for i, (_, message) in worst.items():
        yield CurveFinding("lab-points", ("plots", i, "points", "within"), message)


def _check_run(
    config: Mapping[str, Any], attempt: _Attempt, run: reference.CurveRun
) -> Iterator[CurveFinding]:
    if run.failure is not None and not _is_claimed(config, attempt, run):
        yield _failure(config, run)
        return
    for i, (plot, data) in enumerate(zip(config["plots"], run.plots, strict=True)):
        for j, (trace, line) in enumerate(zip(plot["traces"], data["traces"], strict=True)):
            if None in line and "nan" not in trace["value"]:
                at = _place(config, run.times[line.index(None)])
                message = f"the trace `{trace['label']}` is no finite number at {at}"
                entry: Entry = ("plots", i, "traces", j, "expr")
                yield CurveFinding("lab-value", entry, message, help=_NAN_HELP)
    for i, (readout, value) in enumerate(zip(config["readouts"], run.readouts, strict=True)):
        if value is None and "nan" not in readout["value"]:
            message = f"the readout `{readout['label']}` is no finite number"
            yield CurveFinding("lab-value", ("readouts", i, "expr"), message, help=_NAN_HELP)
    for i, value in zip(attempt.claims, run.claims, strict=False):
        claim = config["expect"][i]
        at = _place(config, claim["at"])
        message = ""
        if claim["value"] is None:
            if run.failure is None or run.end > claim["at"]:
                message = f"the solution goes on after {at}"
        elif value is None:
            message = f"the claim has no finite value at {at}"
        elif claim["min"] is not None and value < claim["min"]:
            message = f"the claim does not hold: {value:.6g} at {at}, not at least {claim['min']:g}"
        elif claim["max"] is not None and value > claim["max"]:
            message = f"the claim does not hold: {value:.6g} at {at}, not at most {claim['max']:g}"
        if message:
            yield CurveFinding("lab-expect", ("expect", i), message)
    goal = config["goal"]
    if goal is None:
        return
    if attempt.is_goal and run.reached is None:
        duration = f": it holds for {run.longest:.3g} at the most, not {goal['hold']:g}"
        message = "the goal is not reached by what `after` sets" + (duration if run.longest else "")
        yield CurveFinding("lab-goal", ("goal", "after"), message)
    elif not attempt.changed and run.reached is not None:
        message = f"the goal is reached at {_place(config, run.reached)} with nothing done"
        help = "ask for something that has to be done"
        yield CurveFinding("lab-goal", ("goal", "expr"), message, help=help)


_NAN_HELP = "say where there is no value: `1/x if x != 0 else nan`"


def _is_claimed(config: Mapping[str, Any], attempt: _Attempt, run: reference.CurveRun) -> bool:
    claims = [claim for claim in config["expect"] if claim["diverges"]]
    assert run.failure is not None
    start = [control["value"] for control in config["controls"]]
    if run.failure["kind"] not in ("value", "blowup"):
        return False
    return any(
        claim["values"] == start
        or any(
            control["label"] in attempt.changed
            for control, a, b in zip(config["controls"], claim["values"], start, strict=True)
            if a != b
        )
        for claim in claims
    )


def _failure(config: Mapping[str, Any], run: reference.CurveRun) -> CurveFinding:
    assert run.failure is not None
    kind, index, t = run.failure["kind"], run.failure["index"], run.failure["t"]
    rule, text, help = _FAILURES[kind]
    entry: Entry = ()
    name = "value"
    if kind == "value" and index >= 0:
        name = f"`{config['states'][index]['name']}`"
        entry = ("states", config["states"][index]["name"], "rate")
    elif kind == "events":
        entry = ("events", index, "when")
    message = text.format(name=name, t=_place(config, t))
    return CurveFinding(rule, entry, message, help=help or _CLAIM_HELP)


def _compare(
    config: dict[str, Any], attempt: _Attempt, run: reference.CurveRun, patience: float
) -> tuple[reference.CurveComparison, Entry]:
    """Compare a run with NumPy and SciPy; return the larger difference, and the entry it is at."""
    tolerance = config["verify"]
    comparison = reference.compare_values(config, attempt.values, run)
    if comparison.difference > tolerance["rtol"] or not config["states"] or run.failure is not None:
        return comparison, ("plots",)
    until = config["axis"]["max"] if tolerance["until"] is None else tolerance["until"]
    states = reference.compare_states(config, attempt.values, run, until, patience)
    return max(comparison, states, key=lambda c: c.difference), ("states",)


def _check_comparison(
    config: Mapping[str, Any], comparison: reference.CurveComparison, entry: Entry
) -> Iterator[CurveFinding]:
    rtol = config["verify"]["rtol"]
    if comparison.difference <= rtol:
        return
    library = "SciPy" if config["states"] else "NumPy"
    at = _place(config, comparison.t)
    if comparison.problem:
        name = f"`{comparison.name}` " if comparison.name else ""
        message = f"the page and {library} differ at {at}: {name}{comparison.problem}"
    else:
        message = (
            f"`{comparison.name}` differs from what {library} computes by "
            f"{comparison.difference:.1e} at {at}, where {rtol:g} is allowed"
        )
    yield CurveFinding("lab-parity", entry, message, help=_CHAOS if config["states"] else "")


def _place(config: Mapping[str, Any], t: float) -> str:
    axis = config["axis"]
    return f"{axis['name']} = {t:.6g}" + (f" {axis['unit']}" if axis["unit"] else "")
