"""What could be left out of a model, and models without it, run and timed beside the original.

Entry points: `Candidate`, `Item`, `PruningContext`; `PruningTrials`.

1. A candidate is a kind of thing that may be in vain, with every place where the model has it. Why
   it must be in vain whatever happens is its `proof`; without one only runs speak for it.
2. A changed model is compiled of the changed text.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
from functools import cached_property
from typing import Any

import mujoco
from msgspec import Struct

from coursebuild.numerics.engine import full_state, initial_data, silent
from coursebuild.numerics.pruning.compare import MotionComparison, Seen, compare
from coursebuild.numerics.pruning.edits import ModelEdit, drop_numbers, remove, set_options
from coursebuild.numerics.pruning.index_map import Gone, IndexMap, fits, index_map, transfer
from coursebuild.numerics.pruning.markup import Element, place_of
from coursebuild.numerics.pruning.model_text import ModelText, saved
from coursebuild.numerics.pruning.readers import Readers
from coursebuild.numerics.reports.diet import Saving
from coursebuild.numerics.scene import Scene
from coursebuild.numerics.timing import Clock, Timing, scenario_job, timed


class Item(Struct, frozen=True, eq=False):
    """One thing that may be in vain, and how to be without it."""

    name: str
    """What it is called; the way to its element where it has no name."""
    element: Element | None
    """Where to point at; `None`: at the model."""
    gone: tuple[Element, ...] = ()
    """Elements to take out."""
    edits: tuple[ModelEdit, ...] = ()
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
    timed: bool = True
    """Whether it may change the time of a step."""
    blocked: str = ""
    """Why it is left to the author even where no bit changes; empty where it is not."""
    doubt: str = ""
    """Who may need it, so that it is no fault; empty where nobody does."""


class PruningContext(Struct, frozen=True, eq=False, dict=True):
    """All that is known before anything is tried."""

    text: ModelText
    readers: Readers
    seen: tuple[Seen, ...]
    """Of the scenarios that went well."""
    used_keyframes: frozenset[int]
    numbered: frozenset[str]
    """What scenarios give by number: `qpos`, `qvel`, `controls`."""

    @property
    def model(self) -> Any:
        """The whole model, compiled."""
        return self.text.model

    @property
    def elements(self) -> tuple[Element, ...]:
        """All elements of its files."""
        return self.text.elements

    @cached_property
    def values(self) -> dict[str, list[tuple[str, Element]]]:
        """For each value of an attribute the attributes that have it, with their elements."""
        found: dict[str, list[tuple[str, Element]]] = {}
        for element in self.elements:
            for one in element.attributes:
                found.setdefault(one.value, []).append((one.name, element))
        return found

    def users(self, name: str, attributes: Collection[str]) -> list[Element]:
        """Elements that name something in one of these attributes."""
        return [element for key, element in self.values.get(name, ()) if name and key in attributes]

    def things(self, kind: str) -> Iterator[tuple[Element, tuple[int, ...]]]:
        """Elements of a kind, with the numbers of what they become in the compiled model."""
        for element in self.elements:
            thing = self.text.ids(element)
            if thing is not None and thing.kind == kind:
                yield element, thing.ids


def worded(items: Sequence[Item], one: str, many: str) -> str:
    """What to say of one item, or of several."""
    return one if len(items) == 1 else many


def called(element: Element) -> str:
    """The name of an element, or the way to it where it has none."""
    return element.get("name") or place_of(element)


def named_item(element: Element, *more: Element) -> Item:
    """An element to take out, with others that go with it."""
    return Item(called(element), element, (element, *more))


# ----------------------------------------------------------------------------------------- trials


class PruningTrial(Struct, frozen=True, eq=False):
    """A changed model, and how it did."""

    edits: tuple[ModelEdit, ...]
    model: Any
    index: IndexMap
    result: MotionComparison | None
    """`None` where it was not compared yet."""


class NotTriedError(Exception):
    """A change that makes no model, or one that cannot be compared."""


class PruningTrials:
    """Tries a model without things, in its scenarios."""

    def __init__(
        self, text: ModelText, scenes: Sequence[Scene], clock: Clock | None, *, quick: bool
    ) -> None:
        self.text = text
        self.scenes = scenes
        self.clock = clock
        self.quick = quick

    def run(self, items: Iterable[Item]) -> PruningTrial:
        """The model without these, in all scenarios.

        Raises:
            NotTriedError: it is no model, or cannot be compared.
        """
        return self.compared(self.changed(items))

    def changed(self, items: Iterable[Item]) -> PruningTrial:
        """The model without these, not compared yet.

        Raises:
            NotTriedError: it is no model, or not the one that it should be.
        """
        edits, gone = changes(self.text, list(items))
        index = index_map(self.text.model, gone)
        try:
            model = self.text.compiled(edits)
        except ValueError as error:
            raise NotTriedError(" ".join(str(error).split())) from None
        if not fits(index, self.text.model, model):
            raise NotTriedError("what is left cannot be told from what is gone")
        return PruningTrial(edits, model, index, None)

    def compared(self, trial: PruningTrial) -> PruningTrial:
        """How a changed model does.

        Raises:
            NotTriedError: that cannot be compared.
        """
        try:
            result = compare(self.text.model, trial.model, trial.index, self.scenes)
        except (ValueError, mujoco.FatalError) as error:
            raise NotTriedError(" ".join(str(error).split())) from None
        return PruningTrial(trial.edits, trial.model, trial.index, result)

    def timing(self, trial: PruningTrial) -> Timing | None:
        """Time of the original over that of a changed model; `None` where it cannot be told."""
        if self.clock is None or not self.scenes:
            return None
        whole, model, index = self.text.model, trial.model, trial.index
        begins, others = [], []
        try:
            for scene in self.scenes:
                data, other = initial_data(scene.scenario, whole), mujoco.MjData(model)
                transfer(whole, data, index, model, other)
                begins.append((scene.scenario, full_state(whole, data)))
                others.append((scene.scenario, full_state(model, other)))
            jobs = (
                scenario_job(whole, begins, self.scenes[0].own),
                scenario_job(model, others, self.scenes[0].own, index.ctrl.tolist()),
            )
            with silent():
                found, own = timed(jobs, 1, self.clock, quick=self.quick)
        except (ValueError, mujoco.FatalError):
            return None
        return found if min(found.nanoseconds.low, own.nanoseconds.low) > 0 else None

    def saving(self, trial: PruningTrial, timing: Timing | None) -> Saving:
        """What a change saves, in time and bytes."""
        before = {one.path: len(one.data) for one in self.text.documents}
        files = self.text.files(trial.edits)
        text = sum(before[path] - len(data) for path, data in files.items())
        memory = len(saved(self.text.model)) - len(saved(trial.model))
        if timing is None:
            return Saving(None, None, False, memory, text)
        ratio = timing.ratio
        return Saving(ratio.value, ratio.half_width / 2, timing.certain, memory, text)


def changes(text: ModelText, items: Sequence[Item]) -> tuple[tuple[ModelEdit, ...], Gone]:
    """All the edits that items make together, and what they take out of the compiled model."""
    elements = list(dict.fromkeys(one for item in items for one in item.gone))
    below = [one for element in elements for one in element.walk()]
    gone = Gone(*(text.ids_of(below, kind) for kind in ("body", "geom", "sensor", "actuator")))
    edits = [*remove(elements), *_keyframes(text, gone, set(below))]
    edits += [edit for item in items for edit in item.edits]
    options = dict(pair for item in items for pair in item.options)
    flags = dict(pair for item in items for pair in item.flags)
    if options or flags:
        edits += set_options(text.main, tuple(options.items()), tuple(flags.items()))
    return _outermost(edits), gone


def _outermost(edits: Iterable[ModelEdit]) -> tuple[ModelEdit, ...]:
    """Without those inside of what another one takes out."""
    found: list[ModelEdit] = []
    for edit in sorted(set(edits), key=lambda one: (one.path, one.start, -one.end)):
        last = found[-1] if found else None
        inside = last is not None and last.path == edit.path and not last.new
        if last is None or not (inside and last.start <= edit.start and edit.end <= last.end):
            found.append(edit)
    return tuple(found)


def _keyframes(text: ModelText, gone: Gone, removed: set[Element]) -> Sequence[ModelEdit]:
    """Keyframes list a number for every coordinate: those of what is gone go too."""
    if not (gone.bodies or gone.actuators):
        return ()
    model, left = text.model, index_map(text.model, gone)

    def lost(size: int, kept: Any, width: int = 1) -> frozenset[int]:
        things = frozenset(range(size)) - frozenset(kept.tolist())
        return frozenset(width * thing + k for thing in things for k in range(width))

    places = {
        "qpos": lost(model.nq, left.qpos),
        "qvel": lost(model.nv, left.dof),
        "act": lost(model.na, left.act),
        "ctrl": lost(model.nu, left.ctrl),
        "mpos": lost(model.nmocap, left.mocap, 3),
        "mquat": lost(model.nmocap, left.mocap, 4),
    }
    keys = [one for one in text.elements if one.tag == "key" and one not in removed]
    return [e for key in keys for name, at in places.items() for e in drop_numbers(key, name, at)]
