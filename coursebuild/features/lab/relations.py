"""Checks how the fields of a lab fit together, and labs with their course.

Every part whose own fields are right is checked, so that a misspelt field does not hide what is
wrong elsewhere.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping

from msgspec import Struct

from coursebuild.api import (
    Course,
    Diagnostic,
    Document,
    FeatureBlock,
    ModelFacts,
    diagnose,
    did_you_mean,
    find_blocks,
    model,
    regex,
)
from coursebuild.core.run.mjcf import read_tags
from coursebuild.core.syntax.decode import check_unique, require_one_of
from coursebuild.core.syntax.fence import with_units
from coursebuild.core.syntax.nodes import (
    ArrayNode,
    Node,
    NumberNode,
    ObjectNode,
    StringNode,
    format_value,
)
from coursebuild.core.text.quantities import unit_of_header
from coursebuild.features.lab.model import BUILT_IN_KINDS, LONGEST_MODEL, Lab
from coursebuild.features.lab.schema import Button, CurveClaim, Expect, Select, SimLab, Slider

Structs = Mapping[ObjectNode, Struct]
Controls = Mapping[str, Struct | None]
"""The controls of a lab by their labels; `None` for one whose fields are wrong."""


def check_lab(node: ObjectNode, structs: Structs) -> Iterator[Diagnostic]:
    """Check everything that the types of the fields cannot say."""
    yield from require_one_of(node, SimLab, ("model", "xml"))
    for name in ("toggles", "overlays"):
        strings = [(item.value, item.span) for item in node.strings(name)]
        yield from check_unique(strings, "field-value", "the overlay `{}` is named twice")
    controls = known_controls(node, structs)
    yield from check_controls(node, structs, ("set", "apply", "param"))
    yield from check_axes(node, structs)
    for claim_node in node.objects("expect"):
        claim = structs.get(claim_node)
        if not isinstance(claim, Expect):
            continue
        yield from check_claim(claim_node, claim)
        if (after := claim_node.get("after")) is not None:
            yield from check_steps(after, "after", controls)
    start = node.get("start")
    if isinstance(start, StringNode):
        yield from _check_step(start, "start", controls)
    goal = node.get("goal")
    if isinstance(goal, ObjectNode):
        before = 0.0
        for entry in goal.objects("log"):
            step, time = entry.get("do"), entry.get("t")
            if step is not None:
                yield from _check_step(step, "do", controls)
            if isinstance(time, NumberNode):
                if time.value < before:
                    message = f"`t` must be at least that of the entry before, {before:g}"
                    yield diagnose("field-value", time.mark, message)
                before = time.value


def check_claim(node: ObjectNode, claim: Expect | CurveClaim) -> Iterator[Diagnostic]:
    """Check that a claim says one thing, which can be."""
    yield from require_one_of(node, type(claim), ("expr", "diverges"))
    if claim.expr is not None:
        yield from require_one_of(node, type(claim), ("min", "max"), only=False)
    elif claim.min is not None or claim.max is not None:
        name = "min" if claim.min is not None else "max"
        message = f"`{name}` bounds an `expr`, and this claim has none"
        yield diagnose("field-value", node.place(name), message)
    yield from check_bounds(node, claim.min, claim.max)


def check_bounds(node: ObjectNode, least: float | None, most: float | None) -> Iterator[Diagnostic]:
    """Check that a value can lie between `min` and `max`."""
    if least is not None and most is not None and least > most:
        message = f"`max` must be at least `min`, which is {least:g}"
        yield diagnose("field-value", node.place("max"), message)


def known_controls(node: ObjectNode, structs: Structs) -> Controls:
    """The controls that the node of a lab lists."""
    pairs = ((c.get("label"), structs.get(c)) for c in node.objects("controls"))
    return {label.value: struct for label, struct in pairs if isinstance(label, StringNode)}


def check_controls(
    node: ObjectNode, structs: Structs, targets: tuple[str, ...]
) -> Iterator[Diagnostic]:
    """Check the controls of a lab, which set one of the `targets`."""
    labels = [control.get("label") for control in node.objects("controls")]
    spans = [(label.value, label.span) for label in labels if isinstance(label, StringNode)]
    yield from check_unique(spans, "field-value", "two controls are called `{}`")
    for control in node.objects("controls"):
        match structs.get(control):
            case Slider(min=low, max=high) as slider:
                yield from require_one_of(control, Slider, targets)
                if not low < high:
                    message = f"`max` must be greater than `min`, which is {low:g}"
                    yield diagnose("field-value", control.place("max"), message)
                    continue
                if not low <= slider.value <= high:
                    message = f"`value` must lie between `min` and `max`: {low:g} to {high:g}"
                    yield diagnose("field-value", control.place("value"), message)
                if slider.step is not None and slider.step > high - low:
                    message = f"`step` is larger than the range from `min` to `max`, {high - low:g}"
                    yield diagnose("field-value", control.place("step"), message)
            case Select() as select:
                yield from require_one_of(control, Select, targets)
                pairs = [p.items for p in control.items("options") if isinstance(p, ArrayNode)]
                for part, message in (
                    (0, "two options are called `{}`"),
                    (1, "two options have the value `{}`"),
                ):
                    texts = zip(select.options, pairs, strict=True)
                    places = [(option[part], pair[part].span) for option, pair in texts]
                    yield from check_unique(places, "field-value", message)
                value = control.get("value")
                if select.value is not None and value is not None:
                    yield from _check_choice(value, "value", select.value, select)
            case _:
                pass


def check_axes(node: ObjectNode, structs: Structs) -> Iterator[Diagnostic]:
    """Check that the bounds of plots leave something between them."""
    for plot in node.objects("plots"):
        struct = structs.get(plot)
        for low, high in (("ymin", "ymax"), ("xmin", "xmax")):
            least, most = getattr(struct, low, None), getattr(struct, high, None)
            if least is not None and most is not None and not least < most:
                message = f"`{high}` must be greater than `{low}`, which is {least:g}"
                yield diagnose("field-value", plot.place(high), message)


def _check_choice(
    node: Node, name: str, value: float | str, select: Select
) -> Iterator[Diagnostic]:
    if any(value == option for _, option in select.options):
        return
    texts = {label: v if isinstance(v, str) else f"{v:g}" for label, v in select.options}
    help = f"the options have {', '.join(f'`{text}`' for text in texts.values())}"
    if value in texts:
        help = f"`{value}` is the label of an option whose value is `{texts[str(value)]}`"
    message = f"`{name}` cannot be {format_value(node)}: no option has this value"
    yield diagnose("field-value", node.mark, message, help=help)


def check_steps(node: Node, name: str, controls: Controls) -> Iterator[Diagnostic]:
    """Check the field `name`: what is done with the controls, one step or a list of them."""
    if isinstance(node, ArrayNode):
        for i, step in enumerate(node.items):
            yield from _check_step(step, f"{name}[{i}]", controls)
    else:
        yield from _check_step(node, name, controls)


def _check_step(node: Node, name: str, controls: Controls) -> Iterator[Diagnostic]:
    """Check one step; messages call it `name`."""
    match node:
        case StringNode(value=name):
            buttons = [b for b, struct in controls.items() if isinstance(struct, Button | None)]
            if name in controls and name not in buttons:
                help = f'give the value that it is set to: `{{"{name}": …}}`'
                yield diagnose("lab-name", node.span, f"`{name}` is not a button", help=help)
            elif name not in buttons:
                help = did_you_mean(name, buttons)
                yield diagnose("lab-name", node.span, f"the lab has no button `{name}`", help=help)
        case ObjectNode():
            if not node.members:
                yield diagnose("field-value", node.mark, f"`{name}` names no control")
            for label, member in node.members.items():
                if isinstance(controls.get(label), Button):
                    alone = "write" if len(node.members) == 1 else "press it in a step of its own:"
                    help = f'{alone} `"{label}"`'
                    message = f"`{label}` is a button and has no value"
                    yield diagnose("lab-name", member.key.span, message, help=help)
                else:
                    yield from _check_setting(member.key, member.value, controls)
        case _:
            pass


def _check_setting(label: StringNode, value: Node, controls: Controls) -> Iterator[Diagnostic]:
    if label.value not in controls:
        names = [name for name, struct in controls.items() if not isinstance(struct, Button)]
        message = f"the lab has no control `{label.value}`"
        yield diagnose("lab-name", label.span, message, help=did_you_mean(label.value, names))
        return
    match controls[label.value]:
        case Slider() as slider:
            if not isinstance(value, NumberNode):
                message = f"`{label.value}` is a slider: its value is a number"
                yield diagnose("field-value", value.mark, message)
            elif not slider.min <= value.value <= slider.max:
                bounds = f"{slider.min:g} to {slider.max:g}"
                message = f"`{label.value}` goes from {bounds}, and cannot be {format_value(value)}"
                yield diagnose("field-value", value.mark, message)
        case Select() as select:
            if isinstance(value, NumberNode | StringNode):
                yield from _check_choice(value, label.value, value.value, select)
        case _:
            pass


_OWN_KIND = regex(r"content/labs/([^/]*)\.js")


def check_labs(course: Course, documents: Iterable[Document]) -> Iterator[Diagnostic]:
    """Report unknown kinds and models of the labs in some documents."""
    own_kinds = (match[1] for path in course.files if (match := _OWN_KIND.fullmatch(path)))
    kinds = frozenset((*BUILT_IN_KINDS, *own_kinds))
    models = {model.name: model.source.text for model in course.models}
    for lab in (lab for document in documents for lab in find_blocks(document, Lab)):
        if lab.kind not in kinds:
            message = f"`{lab.kind}` is not a known kind of lab"
            help = did_you_mean(lab.kind, kinds)
            yield diagnose("lab-kind", lab.kind_span, message, help=help)
        for name in (*lab.models(), *lab.starts):
            if name not in models:
                message, help = f"no model `{name}` in models/", did_you_mean(name, models)
                yield diagnose("lab-model", lab.place(("model",)), message, help=help)
            elif name in lab.starts and not is_editable(models[name]):
                message = (
                    f"readers cannot begin with `{name}`: it needs other files, or is too long"
                )
                yield diagnose("lab-model", lab.place(("model",)), message)


def is_editable(model: str) -> bool:
    """Whether a model needs no other files, and is not too long for an editor."""
    names = (name for tag in read_tags(model) for name, *_ in tag.attributes)
    return len(model) <= LONGEST_MODEL and not any(name.startswith("file") for name in names)


def check_model_names(
    course: Course, facts_of: Callable[[FeatureBlock], ModelFacts | None]
) -> Iterator[Diagnostic]:
    """Report keyframes and sites that the models of labs do not have."""
    for lab in (lab for document in course.documents for lab in find_blocks(document, Lab)):
        facts = facts_of(lab)
        if facts is not None:
            key = lab.fields.key
            if isinstance(key, int) and not 0 <= key < len(facts.keyframes):
                count = f"it has {len(facts.keyframes) or 'none'}"
                message = f"the model has no keyframe {key}: {count}, counted from 0"
                yield diagnose("lab-name", lab.place(("key",)), message)
            for field, element, name, names in (
                ("key", "keyframe", key, [name for name in facts.keyframes if name]),
                ("trail", "site", lab.fields.trail, facts.sites),
            ):
                if isinstance(name, str) and name not in names:
                    message = f"the model has no {element} `{name}`"
                    help = did_you_mean(name, names)
                    yield diagnose("lab-name", lab.place((field,)), message, help=help)


def plotted_numbers(
    numbers: Iterable[model.NumberBinding], lab: ObjectNode
) -> tuple[model.NumberBinding, ...]:
    """The bound numbers of a lab; heights of lines have the unit of the axis, as `v (m/s)`."""
    heights = (
        (height, unit_of_header(label.value).text)
        for plot in lab.objects("plots")
        if isinstance(label := plot.get("ylabel"), StringNode)
        for line in plot.objects("refLines")
        if isinstance(height := line.get("y"), StringNode)
    )
    return with_units(numbers, heights)
