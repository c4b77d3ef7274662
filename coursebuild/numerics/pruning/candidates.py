"""What could be left out of a model, before anything is tried.

Entry points: `Candidate`, `Item`, `Look`, `change`.

A candidate is a kind of thing that may be in vain, with every place where the model has it. Why it
must be in vain whatever happens is its `proof`; without one only runs speak for it.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from msgspec import Struct

from coursebuild.numerics.pruning.compare import Seen
from coursebuild.numerics.pruning.edits import Edit, drop_numbers, remove, set_options
from coursebuild.numerics.pruning.mapping import Gone, mapping_without
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


def named_item(element: Element, *more: Element) -> Item:
    """An element to take out, with others that go with it."""
    return Item(element.get("name") or place_of(element), element, (element, *more))


def change(scene: ModelText, items: Iterable[Item]) -> tuple[tuple[Edit, ...], Gone]:
    """All the edits that items make together, and what they take out of the compiled model."""
    some = list(items)
    gone = list({id(one): one for item in some for one in item.gone}.values())
    below = [one for element in gone for one in element.walk()]
    lost = Gone(
        scene.ids_of(below, "body"),
        scene.ids_of(below, "geom"),
        scene.ids_of(below, "sensor"),
        scene.ids_of(below, "actuator"),
    )
    edits = [*remove(gone), *_keyframes(scene, lost, {id(one) for one in below})]
    edits += [edit for item in some for edit in item.edits]
    options = dict(pair for item in some for pair in item.options)
    flags = dict(pair for item in some for pair in item.flags)
    if options or flags:
        edits += set_options(scene.main, tuple(options.items()), tuple(flags.items()))
    return _outermost(edits), lost


def _outermost(edits: Iterable[Edit]) -> tuple[Edit, ...]:
    """Without those inside of what another one takes out."""
    some = sorted(set(edits), key=lambda one: (one.path, one.start, -one.end))
    found: list[Edit] = []
    for edit in some:
        last = found[-1] if found else None
        inside = last is not None and last.path == edit.path and not last.new
        if last is None or not (inside and last.start <= edit.start and edit.end <= last.end):
            found.append(edit)
    return tuple(found)


def _keyframes(scene: ModelText, gone: Gone, removed: set[int]) -> Sequence[Edit]:
    """Keyframes list a number for every coordinate: those of what is gone go too."""
    if not (gone.bodies or gone.actuators):
        return ()
    model = scene.model
    left = mapping_without(model, gone)

    def lost(size: int, kept: Any) -> frozenset[int]:
        return frozenset(range(size)) - frozenset(kept.tolist())

    mocap = lost(model.nmocap, left.mocap)
    places = {
        "qpos": lost(model.nq, left.qpos),
        "qvel": lost(model.nv, left.dof),
        "act": lost(model.na, left.act),
        "ctrl": lost(model.nu, left.ctrl),
        "mpos": frozenset(3 * i + k for i in mocap for k in range(3)),
        "mquat": frozenset(4 * i + k for i in mocap for k in range(4)),
    }
    keys = [one for one in scene.elements if one.tag == "key" and id(one) not in removed]
    return [e for key in keys for name, at in places.items() for e in drop_numbers(key, name, at)]
