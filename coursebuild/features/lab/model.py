"""Labs: what a reader plays with.

Entry point: `Lab`.
"""

from __future__ import annotations

import hashlib
from typing import TypeAlias

from msgspec.structs import replace

from coursebuild.core.model import Block, FeatureBlock, Inline
from coursebuild.core.text.source import Excerpt, Span
from coursebuild.features.lab.schema import SimLab, Verify

SIMLAB = "simlab"
"""The kind of a lab that names none."""
MJCF = "mjcf"
"""That of a lab whose model the reader edits."""
TRIED = (SIMLAB, MJCF)
"""Kinds that are tried; all others are a course's own."""
START = "if (model.nkey > 0) mj.mj_resetDataKeyframe(model, data, 0);"
"""The `setup` of labs that say nothing of it: they start from the model's first keyframe."""
Entry: TypeAlias = tuple[str | int, ...]
"""The way to a value inside the lab's JSON: `("controls", 2, "set")`."""
_NAMED_BY = {"controls": ("set", "apply", "run", "label"), "expect": ("expr", "diverges")}
"""By which of its values an object in a list is pointed at."""


class Lab(FeatureBlock, frozen=True):
    """A live simulation."""

    kind: str
    """`simlab`, `mjcf`, or the name of a kind that the course adds."""
    kind_span: Span
    config: str
    """JSON on one line, which of some kinds only their own code understands; or MJCF as written."""
    fields: SimLab
    """What the author says; of a kind of the course's own, what labs of every kind have."""
    note: tuple[Block, ...] = ()
    goal: tuple[Inline, ...] = ()
    """The text of its goal."""
    xml: Excerpt | None = None
    places: tuple[tuple[Entry, Span], ...] = ()
    """Where each value of the JSON stands."""
    code: tuple[tuple[Entry, Excerpt], ...] = ()
    """The pieces of JavaScript in it."""

    @property
    def is_of_text(self) -> bool:
        """Whether an author wrote it; if not, it is that of a model which no text shows."""
        return not self.span.path.startswith("models/")

    @property
    def verify(self) -> Verify:
        """How much of it is run."""
        return self.fields.verify or Verify()

    def place(self, entry: Entry) -> Span:
        """Where an entry stands: the value itself, or the nearest around it that is known."""
        places = dict(self.places)
        inner = _NAMED_BY.get(str(entry[0]), ()) if len(entry) == 2 else ()
        ways = [(*entry, name) for name in inner]
        ways += [entry[:end] for end in range(len(entry), 0, -1)]
        known = (places[way] for way in ways if way in places)
        return next(known, self.span).first_line()

    def child_blocks(self) -> tuple[Block, ...]:
        """Its note."""
        return self.note

    def child_inlines(self) -> tuple[Inline, ...]:
        """The text of its goal."""
        return self.goal

    def progress_keys(self) -> tuple[str, tuple[str, ...]] | None:
        """Of its goal: another condition is another goal."""
        goal = self.fields.goal
        if goal is None:
            return None
        condition = f"{self.fields.title}\n{goal.expr}\n{goal.hold}"
        digest = hashlib.sha256(condition.encode("utf-8", "surrogatepass")).hexdigest()
        key = f"goal-{digest[:8]}"
        return key, (key,)

    def tasks(self) -> int:
        """To try it."""
        return 1

    def summary(self) -> Lab:
        """The lab without its Markdown."""
        return replace(self, note=(), goal=())

    def models(self) -> tuple[str, ...]:
        """The model that it names."""
        return () if self.fields.model is None else (self.fields.model,)

    def mjcf(self) -> Excerpt | None:
        """The model that it holds itself."""
        return self.xml

    def is_docked(self) -> bool:
        """Whether its author wants it beside the text."""
        return self.fields.dock
