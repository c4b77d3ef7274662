"""A lab as a value, and the labs of a course."""

from __future__ import annotations

import itertools
import json
from collections.abc import Iterator
from typing import Literal, TypeAlias

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.api import (
    Block,
    Course,
    Document,
    Excerpt,
    FeatureBlock,
    Inline,
    MjcfModel,
    Span,
    Trial,
    find_blocks,
)
from coursebuild.core.syntax.nodes import ArrayNode, Node, ObjectNode
from coursebuild.core.text.source import key_of
from coursebuild.features.lab.schema import Overlay, SimLab, Verify

SIMLAB = "simlab"
"""The kind of a lab that does not name one."""
MJCF = "mjcf"
"""The kind of a lab whose model the reader edits."""
PLOT, ODE = "plot", "ode"
"""The kinds that need no engine."""
BUILT_IN_KINDS = (SIMLAB, MJCF, PLOT, ODE)
"""The kinds that have trials; any other kind is a course's own."""
START = "if (model.nkey > 0) mj.mj_resetDataKeyframe(model, data, 0);"
"""A `setup` that starts from the model's first keyframe, for labs whose author writes none."""
LONGEST_MODEL = 100_000
"""Characters of a model in the editor, as site/js/lab/page/share.js has it."""
Entry: TypeAlias = tuple[str | int, ...]
"""The path to a value inside the lab's JSON: `("controls", 2, "set")`."""
_POINTED_FIELDS = {"controls": ("set", "apply", "run", "label"), "expect": ("expr", "diverges")}
"""The fields at which a diagnostic of an object in a list points; the first there is."""


class Lab(FeatureBlock, frozen=True):
    """A live simulation."""

    kind: str
    """`simlab`, `mjcf`, or the name of a kind that the course adds."""
    kind_span: Span
    config: str
    """JSON on one line, which only the kind's own code may understand; MJCF as written; of a lab
    without an engine, the data that its page runs."""
    fields: SimLab
    """What the author wrote; for a course's own kind, only the fields that all labs have."""
    note: tuple[Block, ...] = ()
    goal: tuple[Inline, ...] = ()
    legend: tuple[tuple[Inline, ...], ...] = ()
    """The text of each entry."""
    xml: Excerpt | None = None
    starts: tuple[str, ...] = ()
    """Names of the models with which a reader may also begin to edit."""
    places: tuple[tuple[Entry, Span], ...] = ()
    """The place of each value in the JSON."""
    code: tuple[tuple[Entry, Excerpt], ...] = ()
    of_exercise: bool = False
    """Whether it is the solution of an exercise, of whose page the exercise's own trial tells."""

    @property
    def is_of_text(self) -> bool:
        """Whether it stands in a text; if not, it was made for a model that no text shows."""
        return not self.span.path.startswith("models/")

    @property
    def verify(self) -> Verify:
        """How much of it the trial runs."""
        return self.fields.verify or Verify()

    def place(self, entry: Entry) -> Span:
        """Return the place of an entry's value, or of the nearest one around it."""
        places = dict(self.places)
        fields = _POINTED_FIELDS.get(str(entry[0]), ()) if len(entry) == 2 else ()
        paths = [(*entry, name) for name in fields]
        paths += [entry[:end] for end in range(len(entry), 0, -1)]
        spans = (places[path] for path in paths if path in places)
        return next(spans, self.span).first_line()

    def child_blocks(self) -> tuple[Block, ...]:
        """The note."""
        return self.note

    def child_inlines(self) -> tuple[Inline, ...]:
        """The texts of the goal and the legend."""
        return (*self.goal, *itertools.chain.from_iterable(self.legend))

    def progress_keys(self) -> tuple[str, tuple[str, ...]] | None:
        """The key of the goal, which changes with the goal's condition."""
        goal = self.fields.goal
        if goal is None:
            return None
        condition = f"{self.fields.title}\n{goal.expr}\n{goal.hold}"
        key = f"goal-{key_of(condition)[:8]}"
        return key, (key,)

    def summary(self) -> Lab:
        """The lab without its Markdown."""
        return replace(self, note=(), goal=(), legend=())

    def models(self) -> tuple[str, ...]:
        """The name of its model, if it names one."""
        return () if self.fields.model is None else (self.fields.model,)

    def mentioned_models(self) -> tuple[str, ...]:
        """The names of models with which a reader may begin to edit."""
        return self.starts

    def mjcf(self) -> Excerpt | None:
        """The model that it holds, if it holds one."""
        return self.xml


class Test(Struct, frozen=True):
    """A trial of an exercise, as its fence has it."""

    name: str
    expr: str
    t: float
    min: float | None
    max: float | None
    unit: str
    hint: str

    def arguments(self) -> Iterator[str]:
        """The arguments of the script's `check` besides the value."""
        values = {"least": self.min, "most": self.max, "unit": self.unit, "hint": self.hint}
        for name, value in values.items():
            if value not in (None, ""):
                yield f"{name}={json.dumps(value, ensure_ascii=False)}"


class Writing(Struct, frozen=True):
    """What a reader writes in a script, and what judges it."""

    subject: str
    """`XML`, `control` or `answer`: what it is called in the script."""
    tests: tuple[Test, ...]
    formula: tuple[str, ...] = ("",)
    """The names of its variables, and its expression, which is empty where it is no formula."""


def values_in(node: Node, path: Entry) -> Iterator[tuple[Entry, Node]]:
    """Yield every value inside a node, with the path to it."""
    parts: list[tuple[str | int, Node]] = []
    if isinstance(node, ObjectNode):
        parts = [(name, member.value) for name, member in node.members.items()]
    elif isinstance(node, ArrayNode):
        parts = list(enumerate(node.items))
    for name, value in parts:
        yield (*path, name), value
        yield from values_in(value, (*path, name))


_NAMES = "{model, data, mj, sim, ctx, lib}"
_FUNCTIONS = {
    "statements": "({}) => {{ {}\n}}",
    "setter": "({}, value) => {{ {}\n}}",
    "expression": "({}) => ({}\n)",
    "target": "({}, value) => {{ ({}\n) = value;\n}}",
}
"""Functions by their form, of names and code; a line end closes a comment with which it may end."""


class LabCode(Struct, frozen=True):
    """A piece of lab code."""

    entry: Entry
    form: Literal["statements", "setter", "expression", "target"]
    """Statements are run; so is a setter, which reads `value`; an expression has a value; a target
    can be assigned to."""
    code: str

    @property
    def function(self) -> str:
        """The piece as a function, as it stands in the module."""
        return _FUNCTIONS[self.form].format(_NAMES, self.code)


# --- the labs of a course

_TOGGLES: tuple[Overlay, ...] = ("frames", "com", "inertia", "joints", "axis")
_DRIFT = "else if (model.nu === 0 && Math.hypot(...model.opt.gravity) === 0) data.qvel.fill(0.5);"
"""Lets a model move that nothing would move."""


def lab_trials(course: Course) -> Iterator[Trial]:
    """Yield every lab of a course, in order; then those made for models that no text shows."""
    for owner, document in course.owned_documents:
        for number, lab in enumerate(find_blocks(document, Lab), 1):
            yield Trial(f"{owner.id}-lab-{number}", owner.id, lab)
    for model, lab in gallery_labs(course):
        yield Trial(f"model-{model.name.replace('/', '-')}", model.name, lab)


def gallery_labs(course: Course) -> Iterator[tuple[MjcfModel, Lab]]:
    """Make a lab for each model that no lab of a text shows."""
    models_in_texts = {name for document in course.documents for name in labs_by_model(document)}
    for model in course.models:
        if model.name not in models_in_texts:
            yield model, gallery_lab(model)


def labs_by_model(document: Document) -> dict[str, Lab]:
    """Map models to their first labs; those in questions are left out, as in summaries."""
    labs: dict[str, Lab] = {}
    blocks = [*find_blocks(document, FeatureBlock)]
    for lab in blocks:
        if isinstance(lab, Lab) and not any(
            block.span.contains(lab.span) for block in blocks if not isinstance(block, Lab)
        ):
            for name in lab.models():
                labs.setdefault(name, lab)
    return labs


def gallery_lab(model: MjcfModel) -> Lab:
    """The lab of a model that no lab of a text shows."""
    place = model.source.span(0, 0)
    return Lab(
        place,
        SIMLAB,
        place,
        "",
        SimLab(
            model=model.name,
            title=model.name,
            toggles=_TOGGLES,
            setup=f"{START} {_DRIFT}",
            # What drifts goes on for ever: the camera shows how it begins.
            verify=Verify(seconds=3),
        ),
    )
