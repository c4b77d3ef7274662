"""What could be left out of a model, before anything is tried.

Entry points: `Candidate`, `Item`, `Look`.

A candidate is a kind of thing that may be in vain, with every place where the model has it. Why it
must be in vain whatever happens is its `proof`; without one only runs speak for it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from msgspec import Struct

from coursebuild.numerics.pruning.compare import Seen
from coursebuild.numerics.pruning.edits import Edit
from coursebuild.numerics.pruning.markup import Element, place_of
from coursebuild.numerics.pruning.model_text import ModelText
from coursebuild.numerics.pruning.readers import Readers


class Item(Struct, frozen=True, eq=False):
    """One thing that may be in vain, and how to be without it."""

    name: str
    """What it is called; the way to its element where it has no name."""
    element: Element | None
    """Where to point at; `None`: at the model."""
    gone: tuple[Element, ...] = ()
    """Elements to take out."""
    edits: tuple[Edit, ...] = ()
    """Other changes of the text."""
    options: tuple[tuple[str, str | None], ...] = ()
    flags: tuple[tuple[str, str | None], ...] = ()


class Candidate(Struct, frozen=True, eq=False):
    """A kind of thing that may be in vain."""

    kind: str
    message: str
    """What is found if it is in vain; `{}` stands for the names."""
    items: tuple[Item, ...]
    proof: str = ""
    """Why it holds whatever happens; empty where only runs can tell."""
    is_setting: bool = False
    """Whether nothing is taken out: only the time that it saves speaks for it."""
    by_runs: bool = False
    """Whether runs are enough, in full length; the proof only says what they show."""
    split: bool = True
    """Whether to look for those of its items without which every bit is the same, where that is
    not so of all together."""
    timed: bool = True
    """Whether it may change the time of a step."""
    blocked: str = ""
    """Why it is left to the author even where no bit changes; empty where it is not."""
    doubt: str = ""
    """Who may need it, so that it is no fault; empty where nobody does."""


class Look(Struct, frozen=True, eq=False):
    """All that is known before anything is tried."""

    scene: ModelText
    readers: Readers
    seen: tuple[Seen, ...]
    """Of the scenarios that went well."""
    used_keyframes: frozenset[int]
    declared: bool
    """Whether `models/NAME.toml` declares scenarios."""
    numbered: frozenset[str]
    """What these give by number: `qpos`, `qvel`, `controls`."""

    @property
    def model(self) -> Any:
        """The whole model, compiled."""
        return self.scene.model


def worded(items: Sequence[Item], one: str, many: str) -> str:
    """What to say of one item, or of several."""
    return one if len(items) == 1 else many


def named_item(element: Element, *more: Element) -> Item:
    """An element to take out, with others that go with it."""
    return Item(element.get("name") or place_of(element), element, (element, *more))
