"""The reply of a trial as diagnostics at the entries of the lab, and names that do not exist."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from msgspec import Struct
from tree_sitter import Node

from coursebuild.api import Diagnostic, Excerpt, Fix, Span, diagnose, did_you_mean, regex
from coursebuild.core.checks.compiled import line_span
from coursebuild.core.run.mjcf import error_line, readable_error
from coursebuild.features.lab.compile import pieces
from coursebuild.features.lab.javascript import dotted_names, parse, text_of, walk
from coursebuild.features.lab.model import MJCF, Entry, Lab, LabCode
from coursebuild.features.lab.reply import TrialFailure, TrialReply
from coursebuild.features.lab.schema import Button

_EXPLANATIONS = {
    "throws": ("lab-throws", "{name} throws{time}: {message}", ""),
    "nan": ("lab-value", "{name} {message}{time}", "return `null` where there is no value"),
    "type": ("lab-value", "{name} {message}", ""),
    "warning": ("lab-warning", "MuJoCo warns{time}: {message}", ""),
    "diverged": (
        "lab-diverged",
        "the simulation diverges{time}: {message}",
        "try a smaller timestep, another integrator, or a narrower range; if that is intended, "
        "claim so: {diverges}",
    ),
    "deep": (
        "lab-penetration",
        "bodies overlap deeply{time}: {message}",
        "MuJoCo does not warn of this: try a smaller timestep, stiffer contacts (`solref`), or a "
        "narrower range; if that is intended, say so: {deep}",
    ),
    "expect": ("lab-expect", "the claim does not hold: {message}", ""),
    "stopAt": ("lab-expect", "{message}", ""),
    "goal": (
        "lab-goal",
        "the goal is reached {message}",
        "ask for something that has to be done",
    ),
    "log": (
        "lab-goal",
        "the log does not reach the goal {message}",
        "reach it in the preview (`coursebuild serve`), and take what `Copy log` gives",
    ),
    "timeout": ("lab-timeout", "{name} {message}", "look for a loop or a list without an end"),
    "length": (
        "lab-timeout",
        "trying {name} takes too long",
        "run less of it: {seconds}, or set `lab` in `[limits]` of the map",
    ),
    "engine": ("lab-engine", "the browser's engine says: {message}", ""),
    "shared": (
        "lab-shared",
        "{name} changes what all labs share: {message}",
        "labs run side by side; keep what this one needs in `ctx`",
    ),
}
"""The rule, text and help of each kind of failure. `log` is a failure of the goal at its log, and
`length` a timeout in which no single call of lab code took long."""


def _entry_name(lab: Lab, entry: Entry) -> str:
    """Name an entry as a reader of the page knows it."""
    match entry:
        case ("controls", int(i), *_) if i < len(lab.fields.controls):
            control = lab.fields.controls[i]
            return f"the {'button' if isinstance(control, Button) else 'control'} `{control.label}`"
        case ("readouts", int(i), *_) if i < len(lab.fields.readouts):
            return f"the readout `{lab.fields.readouts[i].label}`"
        case ("plots", int(i), "traces", int(j), *_) if i < len(lab.fields.plots):
            return f"the trace `{lab.fields.plots[i].traces[j].label}`"
        case ("plots", int(), "x"):
            return "the horizontal axis of a plot"
        case ("expect", int(i), *_) if i < len(lab.fields.expect):
            return "the claim"
        case ("goal", *_):
            return "the goal"
        case (str(name),):
            return f"`{name}`"
        case _:
            return "the lab"


def code_diagnostic(lab: Lab, piece: LabCode, message: str) -> Diagnostic:
    """Report a piece of code that cannot be part of a lab."""
    message = message[:1].lower() + message[1:].rstrip(".")
    message = f"{_entry_name(lab, piece.entry)} has code that cannot run: {message}"
    return diagnose("lab-code", lab.place(piece.entry), message, help=_HELP[piece.form])


_OF_MATH = regex(
    r"ReferenceError: (abs|sqrt|exp|log|a?(?:sin|cos|tan)|atan2|floor|ceil|round|min|max|pow|pi)\b"
)
_HELP = {
    "statements": "",
    "setter": "",
    "expression": "an expression of JavaScript has a value and no `;`, as in `data.qpos[0]`",
    "target": "it must be something that can be assigned to, as `model.opt.timestep`",
}


def failure_diagnostics(lab: Lab, trial: TrialReply) -> Iterator[Diagnostic]:
    """Report what a lab cannot be published with: failures, and untrue fields."""
    # Report each failure of a trial at its entry. MuJoCo warns of the main run again in every
    # attempt; to report it once is enough
    failures = [f for f in trial.failures if f.kind != "deep" and not _is_claimed(lab, f)]
    of_main_run = {f.kind for f in failures if f.entry == () and f.kind in ("warning", "diverged")}
    for failure in failures:
        if failure.entry == () or failure.kind not in of_main_run:
            yield _make_diagnostic(lab, failure)
    if lab.verify.deep and not any(failure.kind == "deep" for failure in trial.failures):
        message = "the lab says `deep`, but no bodies overlapped deeply"
        span = lab.place(("verify", "deep"))
        fix = Fix("remove `deep`", "false", "true", safe=True)
        yield diagnose("lab-shallow", span, message, help=fix)
    parity = None if trial.main is None else trial.main["parity"]
    if parity is not None and not parity.is_within_tolerance(lab.verify.rtol):
        time = (parity.first or 0) * parity.timestep
        tolerance = parity.tolerance(lab.verify.rtol)
        yield diagnose(
            "lab-parity",
            lab.place(("verify", "rtol")),
            f"the browser's engine and native MuJoCo differ from step {parity.first} on "
            f"(t = {time:.6g} s), by up to {parity.relative:.1e} of the state, where {tolerance:g} "
            "is allowed",
            help="a controller that changes `model` while it runs cannot be repeated natively; "
            f"where the motion is chaotic say how far it may part: {_spellings(lab)['parity']}",
        )


def remark_diagnostics(lab: Lab, trial: TrialReply) -> Iterator[Diagnostic]:
    """Report what is to be said of a lab that can be published."""
    # Report bodies that lie deep in each other; only once if the main run has some
    if not lab.verify.deep:
        failures = [f for f in trial.failures if f.kind == "deep"]
        of_main_run = [f for f in failures if f.entry == ()]
        yield from (_make_diagnostic(lab, failure) for failure in of_main_run or failures)
    main = trial.main
    if main is None:
        return
    if (difference := main["resetDiffers"]) is not None:
        entry = difference["entry"]
        message = f"a reset does not return to the start: `{difference['what']}` differs"
        match entry:
            case ("controls", int(i), *_) if not getattr(lab.fields.controls[i], "init", False):
                help = f'{_entry_name(lab, entry)} is not applied again; give it `"init": true`'
            case _:
                help = (
                    "chance from `lib.random()` begins anew with each reset, from `Math.random()` "
                    "it does not; what code has changed in `ctx` or `model` stays until `setup` "
                    "puts it back"
                )
        yield diagnose("lab-reset", lab.place(entry), message, help=help)


_LEAST_MOTION = 0.01
"""Of the picture: less than that is not seen."""


def play_text(share: float | None, still: str) -> str:
    """What a reader sees who presses Play and nothing else, in words; empty where nobody knows.

    `share` is the part of the picture in which something moves, `still` why nothing does.
    """
    if share is None:
        return ""
    if share >= _LEAST_MOTION:
        return f"Play moves {100 * share:.1f} %"
    if still:
        return "Play alone moves nothing, as `still` says"
    return "Play alone moves nothing, and neither `start` nor `still` says more"


def fallen_bodies(trial: TrialReply) -> tuple[str, ...]:
    """Name what has fallen out of the scene, and to where."""
    bodies = [] if trial.main is None else trial.main.get("fallen", [])
    return tuple(
        f"`{body['name']}`, to z = {body['height']:.3g} m at t = {body['time']:.3g} s"
        for body in bodies
    )


def clipped_curves(lab: Lab, reach: Sequence[tuple[float, float] | None]) -> tuple[str, ...]:
    """Name the curves that leave what `ymin` and `ymax` show, and how far they go.

    `reach` is the least and the greatest value of all that plots compute, in turn: of each trace
    and of `x`. By less than a line is wide, a hundredth of what is shown, none leaves.
    """
    texts: list[str] = []
    traces = [
        (plot, trace)
        for plot in lab.fields.plots
        for trace in (*plot.traces, *(() if plot.x is None else (None,)))
    ]
    for (plot, trace), ends in zip(traces, reach, strict=False):
        if ends is None or trace is None:
            continue
        low, high = ends
        least, most = plot.ymin, plot.ymax
        width = abs((high if most is None else most) - (low if least is None else least)) / 100
        if least is not None and low < least - width:
            texts.append(f"`{trace.label}`, down to {low:.3g} (`ymin` is {least:g})")
        if most is not None and high > most + width:
            texts.append(f"`{trace.label}`, up to {high:.3g} (`ymax` is {most:g})")
    return tuple(texts)


def _is_claimed(lab: Lab, failure: TrialFailure) -> bool:
    if failure.kind != "diverged":
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


def _make_diagnostic(lab: Lab, failure: TrialFailure) -> Diagnostic:
    kind: str = failure.kind
    message = (failure.message or "something that has no text").rstrip(".")
    special_help: str | None = None
    span = lab.place(failure.entry)
    match kind:
        case "throws" if function := _OF_MATH.search(message):
            name = f"Math.{function[1].replace('pi', 'PI')}"
            special_help = Fix(f"did you mean `{name}`?", name, function[1], safe=True)
        case "nan" if failure.entry[0] == "expect":
            special_help = ""
        case "expect" if (expr := lab.fields.expect[int(failure.entry[1])].expr) is not None:
            line = " ".join(expr.split())
            code = line if len(line) <= 60 else line[:59] + "…"
            message = f"`{code}` {message}"
        case "goal" if failure.entry[-1] == "log":
            kind = "log"
        case "timeout" if message == "did not finish in time":
            kind = "length"
        case "engine":
            if lab.xml is not None:
                span = line_span(lab.xml, error_line(message, lab.xml.text), 0, span)
            if lab.kind == MJCF and "opening file" in message:
                special_help = (
                    "a model that the reader edits is one text, beside which there are no files"
                )
            message = readable_error(message.replace("MuJoCo Error: ", ""))
        case _:
            pass
    rule, text, help = _EXPLANATIONS[kind]
    values = {
        "name": _entry_name(lab, failure.entry),
        "time": f" at t = {failure.time:.6g} s" if failure.time else "",
        "message": message,
    }
    during = "" if failure.during is None else failure.during.description
    return diagnose(
        rule,
        span,
        text.format_map(values),
        label=f"while trying: {during}" if during not in ("", "start") else "",
        help=help.format_map(_spellings(lab)) if special_help is None else special_help,
    )


_SPELLINGS = {
    "diverges": ('"expect": [{"t": …, "diverges": true}]', "diverges=…"),
    "deep": ('"verify": {"deep": true}', "deep"),
    "seconds": ('"verify": {"seconds": …}', "seconds=…"),
    "parity": ('"verify": {"rtol": …, "seconds": …}', "rtol=… seconds=…"),
}


def _spellings(lab: Lab) -> dict[str, str]:
    """Return how a lab's author writes settings: in the JSON, or as keys of the fence."""
    return {name: f"`{pair[lab.kind == MJCF]}`" for name, pair in _SPELLINGS.items()}


_OPEN_OBJECTS = ("ctx", "value", "globalThis")
"""Objects that may have any members."""
_SIZES = {"qpos": "nq", "qvel": "nv", "qacc": "nv", "ctrl": "nu", "act": "na"}
"""Arrays whose length is a size of the model."""


class NameReference(Struct, frozen=True):
    """A name with dots in the code of a lab, or an element of what it names."""

    path: tuple[str, ...]
    places: tuple[Span, ...]
    index: int | None = None
    element: Span | None = None
    """The place of all of it, brackets included."""


def _written_pieces(lab: Lab) -> Iterator[tuple[LabCode, Excerpt]]:
    """The pieces of code that the text of a lab holds, each with its place there."""
    code = dict(lab.code)
    return ((piece, code[piece.entry]) for piece in pieces(lab) if piece.entry in code)


def references(lab: Lab) -> list[NameReference]:
    """List the names that the pieces of a lab use and do not declare themselves."""
    return [name for _, text in _written_pieces(lab) for name in code_references(text)]


def code_references(text: Excerpt) -> list[NameReference]:
    """The same of a piece of code."""
    names: list[NameReference] = []
    nodes = list(walk(parse(text.text)))
    declared_names = _declared_names(nodes)
    for node in nodes:
        parts = dotted_names(node) if node.type == "member_expression" else ()
        path = tuple(map(text_of, parts))
        outer = node.parent
        is_longer_name = outer is not None and outer.type == "member_expression"
        if len(path) < 2 or path[0] in (*declared_names, *_OPEN_OBJECTS) or is_longer_name:
            continue
        places = tuple(_place_in(text, part) for part in parts)
        index = outer.child_by_field_name("index") if outer is not None else None
        if outer is not None and index is not None and text_of(index).isdecimal():
            place = _place_in(text, outer)
            names.append(NameReference(path, places, int(text_of(index)), place))
        else:
            names.append(NameReference(path, places))
    return names


def assignment_diagnostics(lab: Lab) -> Iterator[Diagnostic]:
    """Report expressions that assign to anything but variables of their own."""
    for piece, text in _written_pieces(lab):
        if piece.form != "expression":
            continue
        nodes = list(walk(parse(piece.code)))
        declared_names = _declared_names(nodes)
        for node in nodes:
            target = node.child_by_field_name("left") or node.child_by_field_name("argument")
            if node.type not in _CHANGES or target is None:
                continue
            owner = target
            while (inner := owner.child_by_field_name("object")) is not None:
                owner = inner
            if text_of(owner) in declared_names:
                continue
            message = f"{_entry_name(lab, piece.entry)} changes `{text_of(target)}`"
            operator = next((sign for sign in node.children if sign.type == "="), None)
            place, help = _place_in(text, operator or node), "an expression only reads"
            if operator is not None:
                help = Fix("to compare, write `===`", "===")
            yield diagnose("lab-code", place, message, help=help)


def parameter_diagnostics(lab: Lab) -> Iterator[Diagnostic]:
    """Report what is read from `ctx` though nothing sets it; nothing if `ctx` is used whole."""
    names = {getattr(control, "param", None) or "" for control in lab.fields.controls}
    reads = list[tuple[Excerpt, Node]]()
    for piece, text in _written_pieces(lab):
        for node in walk(parse(text.text)):
            if node.type != "identifier" or text_of(node) != "ctx":
                continue
            member = node.parent
            name = None if member is None else member.child_by_field_name("property")
            if member is None or name is None or member.parent is None:
                return
            outer, sign = member.parent, member.parent.child_by_field_name("operator")
            is_left = outer.child_by_field_name("left") == member
            sets = outer.type in ("assignment_expression", "for_in_statement")
            sets = is_left and (sets or (sign is not None and text_of(sign) in ("??=", "||=")))
            is_target = piece.form == "target" and text_of(member) == text.text.strip()
            if sets or is_target or outer.type.endswith("_pattern"):
                names.add(text_of(name))
            else:
                reads.append((text, name))
    for text, name in reads:
        if text_of(name) not in names:
            message = f"nothing in this lab sets `ctx.{text_of(name)}`"
            help = did_you_mean(text_of(name), names - {""})
            yield diagnose("lab-name", _place_in(text, name), message, help=help)


_CHANGES = ("assignment_expression", "augmented_assignment_expression", "update_expression")


def _declared_names(nodes: Sequence[Node]) -> frozenset[str]:
    names: set[str] = set()
    for node in nodes:
        if node.type == "formal_parameters" or node.type.endswith("_pattern"):
            names.update(map(text_of, node.named_children))
        for field in ("name", "parameter", "left"):
            child = node.child_by_field_name(field)
            is_declared = field != "left" or node.type not in _CHANGES
            if child is not None and child.type == "identifier" and is_declared:
                names.add(text_of(child))
    return frozenset(names)


def _place_in(code: Excerpt, node: Node) -> Span:
    data = code.text.encode("utf-8", "replace")
    start, end = (len(data[:at].decode()) for at in (node.start_byte, node.end_byte))
    return code.span(start, end)


def name_diagnostics(
    references: Sequence[NameReference], replies: Sequence[dict[str, Any]]
) -> Iterator[Diagnostic]:
    """Report the names that do not exist, as the engine's reply to each says."""
    for reference, reply in zip(references, replies, strict=True):
        path, length, at = reference.path, reply.get("length"), reply.get("at")
        if at is not None:
            owner = ".".join(path[:at])
            message = f"`{owner}` has no `{path[at]}`" if owner else f"there is no `{path[0]}`"
            help = did_you_mean(path[at], reply["names"])
            yield diagnose("lab-name", reference.places[at], message, help=help)
        elif length is not None and reference.index is not None and reference.index >= length:
            assert reference.element is not None
            size = _SIZES.get(path[-1]) if path[0] == "data" else None
            extent = f"`{size}` is {length}" if size else f"the array has {length} numbers"
            message = f"`{'.'.join(path)}[{reference.index}]` does not exist: {extent}"
            yield diagnose("lab-name", reference.element, message, help="numbers count from 0")
