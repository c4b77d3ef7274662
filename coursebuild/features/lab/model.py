"""A lab as a value."""

from __future__ import annotations

import itertools
import json
from collections.abc import Iterator
from typing import TypeAlias

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.api import Block, Excerpt, FeatureBlock, Inline, Span
from coursebuild.core.syntax.nodes import ArrayNode, Node, ObjectNode
from coursebuild.core.text.source import key_of
from coursebuild.features.lab.schema import SimLab, Verify

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
