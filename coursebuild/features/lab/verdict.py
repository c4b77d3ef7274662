"""What a trial found, as diagnostics at the entries of the lesson.

Entry points: `failure_diagnostics` and `remark_diagnostics` of a lab and its trial;
`code_diagnostic`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from coursebuild.core.checks.compiled import line_span
from coursebuild.core.run.mjcf import error_line, readable_error
from coursebuild.core.run.versions import engine_version
from coursebuild.core.text.diagnostics import Diagnostic, diagnose
from coursebuild.features.lab.compile import LabCode
from coursebuild.features.lab.model import MJCF, Entry, Lab
from coursebuild.features.lab.reply import Parity, TrialFailure, TrialReply
from coursebuild.features.lab.schema import Button

_RULES = {
    "throws": "lab-throws",
    "nan": "lab-value",
    "type": "lab-value",
    "warning": "lab-warning",
    "diverged": "lab-diverged",
    "deep": "lab-penetration",
    "expect": "lab-expect",
    "stopAt": "lab-expect",
    "goal": "lab-goal",
    "timeout": "lab-timeout",
    "engine": "lab-engine",
    "shared": "lab-shared",
}


def _named(lab: Lab, entry: Entry) -> str:
    """An entry in words, by the name that a reader of the page knows."""
    match entry:
        case ("controls", int(i), *_) if i < len(lab.fields.controls):
            control = lab.fields.controls[i]
            return f"the {'button' if isinstance(control, Button) else 'control'} `{control.label}`"
        case ("readouts", int(i), *_) if i < len(lab.fields.readouts):
            return f"the readout `{lab.fields.readouts[i].label}`"
        case ("plots", int(i), "traces", int(j), *_) if i < len(lab.fields.plots):
            return f"the trace `{lab.fields.plots[i].traces[j].label}`"
        case ("expect", int(i), *_) if i < len(lab.fields.expect):
            return "the claim"
        case ("goal", *_):
            return "the goal"
        case (str(name),):
            return f"`{name}`"
        case _:
            return "the lab"


def code_diagnostic(lab: Lab, piece: LabCode, message: str) -> Diagnostic:
    """A piece of code that cannot be part of a lab."""
    message = message[:1].lower() + message[1:].rstrip(".")
    what = f"{_named(lab, piece.entry)} has code that cannot run: {message}"
    help = _PYTHON_HELP if _PYTHON.search(piece.code) else _HELP[piece.form]
    return diagnose("lab-code", lab.place(piece.entry), what, help=help)


_PYTHON = re.compile(r"\b(and|or|not)\b| if .* else ")
_OF_MATH = re.compile(
    r"ReferenceError: (abs|sqrt|exp|log|a?(?:sin|cos|tan)|atan2|floor|ceil|round|min|max|pow|pi)\b"
)
_PYTHON_HELP = (
    "code in a lab is JavaScript: `&&`, `||`, `!`, and `test ? a : b` for `a if test else b`"
)
_HELP = {
    "statements": "",
    "setter": "",
    "expression": "an expression has a value and no `;`, as in `data.qpos[0]`",
    "target": "it must be something that can be assigned to, as `model.opt.timestep`",
}


def failure_diagnostics(lab: Lab, trial: TrialReply) -> Iterator[Diagnostic]:
    """What a lab cannot be shown with: failures, another engine, and what it says in vain."""
    yield from _failures(lab, trial)
    if trial.version != engine_version():
        message = f"the browser's engine is {trial.version}, native MuJoCo {engine_version()}"
        yield diagnose("lab-engine", lab.span.first_line(), message)
    yield from _shallow(lab, trial)
    if trial.main is not None and trial.main["parity"] is not None:
        yield from _parity(lab, trial.main["parity"])


def remark_diagnostics(lab: Lab, trial: TrialReply) -> Iterator[Diagnostic]:
    """What is to be said of a lab that can be shown."""
    yield from _deep(lab, trial)
    yield from _reset(lab, trial)
    yield from _far(lab, trial)


def _failures(lab: Lab, trial: TrialReply) -> Iterator[Diagnostic]:
    """Each failure of a trial, at its entry.

    What MuJoCo says of the main run it says again of every act; once is enough.
    """
    told = [f for f in trial.failures if f.kind != _DEEP and not _is_claimed(lab, f)]
    always = {f.kind for f in told if f.entry == () and f.kind in _OF_MUJOCO}
    yield from (_failure(lab, f) for f in told if f.entry == () or f.kind not in always)


def _is_claimed(lab: Lab, failure: TrialFailure) -> bool:
    """Whether the lab claims that it diverges there: with these controls, or as it starts."""
    if failure.kind != _DIVERGED:
        return False
    claims = [claim for claim in lab.fields.expect if claim.diverges]
    from_start = any(not claim.steps for claim in claims)
    match failure.entry:
        case ("expect", int(i), *_):
            return lab.fields.expect[i].diverges
        case ("controls", int(i), *_):
            label = lab.fields.controls[i].label
            return from_start or any(label in claim.controls for claim in claims)
        case _:
            return from_start


_DEEP, _DIVERGED = "deep", "diverged"
_OF_MUJOCO = ("warning", _DIVERGED)


def _deep(lab: Lab, trial: TrialReply) -> Iterator[Diagnostic]:
    """Bodies that lie deep in each other, and are not to; once where the main run has some."""
    if not lab.verify.deep:
        failures = [f for f in trial.failures if f.kind == _DEEP]
        always = [f for f in failures if f.entry == ()]
        yield from (_failure(lab, failure) for failure in always or failures)


def _shallow(lab: Lab, trial: TrialReply) -> Iterator[Diagnostic]:
    """That no bodies lie deep in each other, though the lab says that they are to."""
    if lab.verify.deep and not any(failure.kind == _DEEP for failure in trial.failures):
        what = "the lab says `deep`, and no bodies lay deep in each other"
        span = lab.place(("verify", "deep"))
        yield diagnose("lab-shallow", span, what, help="take `deep` away")


def _far(lab: Lab, trial: TrialReply) -> Iterator[Diagnostic]:
    """That what moves is small in the picture, because of the lab's own camera."""
    main = trial.main
    if main is None or (fill := main["fill"]) is None or (most := main["mostFill"]) is None:
        return
    if fill < _SMALL and fill < most / 2:
        what = (
            f"what moves fills {100 * fill:.2g} % of the picture, and could fill {100 * most:.2g} %"
        )
        help = "without `distance` and `target` the camera fits the motion"
        yield diagnose("lab-far", lab.place(("camera",)), what, help=help)


_SMALL = 0.1


def _failure(lab: Lab, failure: TrialFailure) -> Diagnostic:
    during = "" if failure.during is None else failure.during.what
    tried = f"while trying: {during}" if during not in ("", "start") else ""
    text, help = _explain(lab, failure)
    span = lab.place(failure.entry)
    if lab.xml is not None and failure.kind == "engine":
        line = error_line(failure.message or "", lab.xml.text)
        span = line_span(lab.xml, line, 0, span)
    return diagnose(_RULES[failure.kind], span, text, label=tried, help=help)


def _explain(lab: Lab, failure: TrialFailure) -> tuple[str, str]:
    """What is wrong, and what helps."""
    name = _named(lab, failure.entry)
    when = f" at t = {failure.time:.6g} s" if failure.time else ""
    message = (failure.message or "something that has no text").rstrip(".")
    match failure.kind:
        case "throws":
            known = _OF_MATH.search(message)
            help = f"did you mean `Math.{known[1].replace('pi', 'PI')}`?" if known else ""
            return f"{name} throws{when}: {message}", help
        case "nan":
            help = (
                "where there is to be no value, give `null`" if failure.entry[0] != "expect" else ""
            )
            return f"{name} {message}{when}", help
        case "type":
            return f"{name} {message}", ""
        case "warning":
            return f"MuJoCo warns{when}: {message}", ""
        case "diverged":
            help = (
                "try a smaller timestep, another integrator, or a narrower range; if it is to "
                f"diverge, claim so: {_written(lab, 'diverges')}"
            )
            return f"the simulation diverges{when}: {message}", help
        case "deep":
            help = (
                "MuJoCo does not warn of this: try a smaller timestep, stiffer contacts "
                "(`solref`), or a narrower range; if they are to lie so, say so: "
                f"{_written(lab, 'deep')}"
            )
            return f"bodies lie deep in each other{when}: {message}", help
        case "expect":
            expr = lab.fields.expect[int(failure.entry[1])].expr
            what = f"`{_short(expr)}` {message}" if expr is not None else message
            return f"the claim does not hold: {what}", ""
        case "goal" if failure.entry[-1] == "log":
            help = "reach it in the preview (`coursebuild serve`), and take what `Copy log` gives"
            return f"the log does not reach the goal {message}", help
        case "goal":
            return f"the goal is reached {message}", "ask for something that has to be done"
        case "timeout" if message == "did not finish in time":
            return f"trying {name} takes too long", f"run less of it: {_written(lab, 'seconds')}"
        case "timeout":
            return f"{name} {message}", "look for a loop or a list without an end"
        case "shared":
            help = "labs run side by side; keep what this one needs in `ctx`"
            return f"{name} changes what all labs share: {message}", help
        case "engine":
            help = (
                "a model that the reader edits is one text, beside which there are no files"
                if lab.kind == MJCF and "opening file" in message
                else ""
            )
            said = readable_error(message.replace("MuJoCo Error: ", ""))
            return f"the browser's engine says: {said}", help
        case _:
            return message, ""


def _reset(lab: Lab, trial: TrialReply) -> Iterator[Diagnostic]:
    """A reset after the main run that led to another state than that of the start."""
    found = trial.main["resetDiffers"] if trial.main is not None else None
    if found is None:
        return
    entry = found["entry"]
    message = f"a reset does not lead back to the start: `{found['what']}` differs"
    match entry:
        case ("controls", int(i), *_) if not getattr(lab.fields.controls[i], "init", False):
            help = f'{_named(lab, entry)} is not applied again; give it `"init": true`'
        case _:
            help = (
                "chance from `lib.random()` begins anew with each reset, from `Math.random()` it "
                "does not; what code has changed in `ctx` or `model` stays until `setup` puts it "
                "back"
            )
    yield diagnose("lab-reset", lab.place(entry), message, help=help)


def _parity(lab: Lab, parity: Parity) -> Iterator[Diagnostic]:
    """A difference between the engines that is larger than allowed."""
    if parity.within(lab.verify.rtol):
        return
    time = (parity.first or 0) * parity.timestep
    allowed = parity.allowed(lab.verify.rtol)
    yield diagnose(
        "lab-parity",
        lab.place(("verify", "rtol")),
        f"the browser's engine and native MuJoCo differ from step {parity.first} on "
        f"(t = {time:.6g} s), by up to {parity.relative:.1e} of the state, where {allowed:g} is "
        "allowed",
        help="a controller that changes `model` while it runs cannot be repeated natively; where "
        f"the motion is chaotic say how far it may part: {_written(lab, 'parity')}",
    )


_WRITTEN = {
    "diverges": ('"expect": [{"t": …, "diverges": true}]', "diverges=…"),
    "deep": ('"verify": {"deep": true}', "deep"),
    "seconds": ('"verify": {"seconds": …}', "seconds=…"),
    "parity": ('"verify": {"rtol": …, "seconds": …}', "rtol=… seconds=…"),
}


def _written(lab: Lab, what: str) -> str:
    """How a lab says something: in its JSON, or by keys of its fence."""
    return f"`{_WRITTEN[what][lab.kind == MJCF]}`"


def _short(code: str) -> str:
    line = " ".join(code.split())
    return line if len(line) <= 60 else line[:59] + "…"
