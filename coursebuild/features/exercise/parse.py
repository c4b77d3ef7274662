"""`exercise` fences: TOML, with the subject of the exercise after the word `exercise`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import get_args

from msgspec import Struct

from coursebuild.api import (
    Diagnostic,
    Excerpt,
    Fence,
    Parsed,
    Prose,
    Span,
    TextParser,
    decode,
    diagnose,
    did_you_mean,
    parse_toml,
)
from coursebuild.core.syntax.decode import check_unique, has_value, require_one_of
from coursebuild.core.syntax.nodes import TOML, ObjectNode, StringNode
from coursebuild.core.text.diagnostics import sort_diagnostics
from coursebuild.features.exercise.model import (
    CONTROLLER,
    FORMULA,
    MODEL,
    SUBJECTS,
    Exercise,
    Subject,
    Wrong,
    attempt_function,
)
from coursebuild.features.exercise.schema import ExerciseFile, HiddenTrial
from coursebuild.features.lab.model import SIMLAB, Entry, Lab
from coursebuild.features.lab.relations import check_axes, check_bounds
from coursebuild.features.lab.schema import Button, Readout, SimLab


def parse_fence(fence: Fence, texts: TextParser) -> Parsed[Exercise | None]:
    """Parse the exercise of a fence. Never raises."""
    keys = fence.keys(has_name=True)
    name = keys.value.name
    subject = next((s for s in get_args(Subject) if name is not None and s == name.key), None)
    toml = parse_toml(fence.body, rule="toml-syntax")
    diagnostics = [*keys.diagnostics, *toml.diagnostics]
    if subject is None:
        message = "an exercise says what the reader writes"
        help = "write `exercise model`, `exercise controller` or `exercise formula`"
        if name is not None:
            message = f"`{name.key}` is nothing that an exercise can be about"
            help = did_you_mean(name.key, SUBJECTS) or help
        place = fence.head if name is None else name.span
        diagnostics.append(diagnose("fence-info", place, message, help=help))
    node, exercise = toml.value, None
    if node is not None:
        decoding = decode(node, ExerciseFile, "the exercise", TOML)
        prose = Prose.read(decoding.texts, texts)
        diagnostics += [*decoding.diagnostics, *prose.diagnostics]
        if subject is not None:
            diagnostics += _check(node, decoding.structs, subject)
        fields = decoding.value
        if isinstance(fields, ExerciseFile) and subject is not None and not diagnostics:
            mistakes = zip(node.objects("wrong"), fields.wrong, strict=True)
            exercise = Exercise(
                span=fence.span,
                id=fields.id,
                id_span=node.place("id"),
                subject=subject,
                title=fields.title,
                names=fields.names,
                start=_text(node, "start"),
                solution=_text(node, "solution"),
                wrong=tuple(
                    Wrong(_text(n, "text"), w.fails, n.place("fails")) for n, w in mistakes
                ),
                trials=fields.trials,
                trial_places=tuple(trial.place("name") for trial in node.objects("trials")),
                setup=fields.setup,
                lab=_lab(subject, node, fields),
                task=prose.blocks(node.get("text")),
                explain=prose.blocks(node.get("explain")),
                numbers=prose.numbers,
            )
    return Parsed(exercise, sort_diagnostics(diagnostics))


def _check(
    node: ObjectNode, structs: Mapping[ObjectNode, Struct], subject: Subject
) -> Iterator[Diagnostic]:
    """Check everything that the types of the fields cannot say."""
    for field, subjects in (("model", (CONTROLLER, FORMULA)), ("names", (FORMULA,))):
        if has_value(node, field) and subject not in subjects:
            message = f"`exercise {subject}` has no field `{field}`"
            yield diagnose("field-unknown", node.members[field].key.span, message)
        elif not has_value(node, field) and subject in subjects and field == "model":
            message = f"`model` is missing: the {subject} acts in one"
            yield diagnose("field-missing", node.mark, message)
    trials = node.objects("trials")
    names = [trial.get("name") for trial in trials]
    places = [(name.value, name.span) for name in names if isinstance(name, StringNode)]
    yield from check_unique(places, "field-value", "two trials are called `{}`")
    for trial_node in trials:
        trial = structs.get(trial_node)
        if not isinstance(trial, HiddenTrial):
            continue
        yield from require_one_of(trial_node, HiddenTrial, ("min", "max"), only=False)
        yield from check_bounds(trial_node, trial.min, trial.max)
    known_names = [name for name, _ in places]
    for attempt in node.objects("wrong"):
        fails = attempt.get("fails")
        if isinstance(fails, StringNode) and fails.value not in known_names:
            message = f"no trial is called `{fails.value}`"
            help = did_you_mean(fails.value, known_names)
            yield diagnose("field-value", fails.span, message, help=help)
    yield from check_axes(node, structs)


def _lab(subject: Subject, node: ObjectNode, fields: ExerciseFile) -> Lab:
    """The lab that shows the solution; its trial proves that the solution runs in both engines."""
    solution, trials = _text(node, "solution"), node.objects("trials")
    setup, controller = fields.setup, ""
    code: list[tuple[Entry, Excerpt]] = []
    if fields.setup:
        code.append((("setup",), _text(node, "setup")))
    if subject == CONTROLLER:
        controller = solution.text
        code.append((("controller",), solution))
    elif subject == FORMULA:
        # What the reader writes is in place before the setup runs
        function = attempt_function(subject, fields.names, solution.text)
        setup = f"ctx.answer ??= {function};\n{setup}"
        begin = Excerpt(
            solution.source, setup[: len(setup) - len(fields.setup)], solution.pieces[:1]
        )
        code[:1] = [(("setup",), Excerpt.join([begin, *(text for _, text in code)]))]
    places: list[tuple[Entry, Span]] = [
        (("setup",), node.place("setup" if fields.setup else "solution")),
        (("controller",), solution.span()),
    ]
    places += [((name,), node.place(name)) for name in ("model", "key") if name in node.members]
    # Play runs the `setup` of the first trial in which time passes, if it has one.
    played = [t for t in fields.trials if t.t] or [t for t in fields.trials if t.setup]
    buttons: list[Button] = []
    readouts: list[Readout] = []
    for i, (trial_node, trial) in enumerate(zip(trials, fields.trials, strict=True)):
        expr: Entry = ("readouts", i, "expr")
        code.append((expr, _text(trial_node, "expr")))
        places.append((expr, trial_node.place("expr")))
        unit = f" ({trial.unit})" if trial.unit else ""
        readouts.append(Readout(f"{trial.name}{unit}", trial.expr, trial.digits))
        if trial.setup:
            run: Entry = ("controls", len(buttons), "run")
            code.append((run, _text(trial_node, "setup")))
            places.append((run, trial_node.place("setup")))
            buttons.append(Button(trial.name, trial.setup))
    return Lab(
        span=solution.span(),
        kind=SIMLAB,
        kind_span=solution.span(),
        config="",
        fields=SimLab(
            title=fields.title,
            height=fields.height,
            model=fields.model,
            key=fields.key,
            camera=fields.camera,
            start=played[0].name if played and played[0].setup else None,
            still=fields.still,
            setup=setup,
            controller=controller,
            controls=tuple(buttons),
            readouts=tuple(readouts),
            plots=fields.plots,
        ),
        xml=solution if subject == MODEL else None,
        places=tuple(places),
        code=tuple(code),
        of_exercise=True,
    )


def _text(node: ObjectNode, name: str) -> Excerpt:
    value = node.get(name)
    assert isinstance(value, StringNode)
    return value.excerpt
