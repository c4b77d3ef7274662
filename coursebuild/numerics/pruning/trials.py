"""What could be left out of a model, and models without it, run and timed beside the original.

Entry points: `Candidate`, `Item`, `PruningContext`; `PruningTrials`.

1. A candidate is a kind of thing that may be in vain, with every place where the model has it. Why
   it must be in vain whatever happens is its `proof`; without one only runs speak for it.
2. A changed model is compiled of the changed text.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cached_property
from typing import Any

import mujoco
from msgspec import Struct

from coursebuild.numerics.engine import initial_data
from coursebuild.numerics.pruning.compare import Case, MotionComparison, Seen, compare
from coursebuild.numerics.pruning.edits import ModelEdit, drop_numbers, remove, set_options
from coursebuild.numerics.pruning.mapping import Gone, fits, mapping_without, transfer
from coursebuild.numerics.pruning.mapping import Mapping as Left
from coursebuild.numerics.pruning.markup import Element, place_of
from coursebuild.numerics.pruning.model_text import ModelText, saved
from coursebuild.numerics.pruning.readers import Readers
from coursebuild.numerics.reports.diet import Saving
from coursebuild.numerics.timing import (
    STATE,
    Clock,
    Stepped,
    full_state,
    moments,
    time_ratio,
)


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
    split: bool = True
    """Whether to look for those of its items without which every bit is the same, where that is
    not so of all together."""
    timed: bool = True
    """Whether it may change the time of a step."""
    blocked: str = ""
    """Why it is left to the author even where no bit changes; empty where it is not."""
    doubt: str = ""
    """Who may need it, so that it is no fault; empty where nobody does."""


class PruningContext(Struct, frozen=True, eq=False):
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


# ----------------------------------------------------------------------------------------- trials


class PruningTrial(Struct, frozen=True, eq=False):
    """A changed model, and how it did."""

    edits: tuple[ModelEdit, ...]
    model: Any
    left: Left
    result: MotionComparison


class Ratio(Struct, frozen=True):
    """How much faster a model is than another."""

    value: float
    """Over 1 where it is faster."""
    spread: float
    """Its standard error, relative."""

    @property
    def certain(self) -> bool:
        """Whether it is another than 1 beyond what the measurement can tell."""
        return abs(self.value - 1.0) > max(0.03, 2 * self.spread)


class NotTriedError(Exception):
    """A change that makes no model, or one that cannot be compared."""


class PruningTrials:
    """Tries a model without things, in its scenarios."""

    def __init__(
        self, scene: ModelText, cases: Sequence[Case], clock: Clock, *, quick: bool
    ) -> None:
        self.scene = scene
        self.cases = cases
        self.clock = clock
        self.quick = quick

    def run(self, items: Iterable[Item]) -> PruningTrial:
        """The model without these, in all scenarios.

        Raises:
            NotTriedError: it is no model, or cannot be compared.
        """
        edits, model, left = self.changed(items)
        return PruningTrial(edits, model, left, self.compared(model, left))

    def changed(self, items: Iterable[Item]) -> tuple[tuple[ModelEdit, ...], Any, Left]:
        """The edits without these, the model that they give, and what is left of the original.

        Raises:
            NotTriedError: it is no model, or not the one that it should be.
        """
        scene = self.scene
        edits, gone = change(scene, items)
        left = mapping_without(scene.model, gone)
        try:
            model = scene.compiled(edits)
        except ValueError as error:
            raise NotTriedError(" ".join(str(error).split())) from None
        if not fits(left, scene.model, model):
            raise NotTriedError("what is left cannot be told from what is gone")
        return edits, model, left

    def compared(self, model: Any, left: Left) -> MotionComparison:
        """How a changed model does.

        Raises:
            NotTriedError: that cannot be compared.
        """
        try:
            return compare(self.scene.model, model, left, self.cases)
        except (ValueError, mujoco.FatalError) as error:
            raise NotTriedError(" ".join(str(error).split())) from None

    def ratio(self, model: Any, left: Left) -> Ratio | None:
        """Time of the original over that of a changed model; `None` where it cannot be told."""
        whole = self.scene.model
        data, other = mujoco.MjData(whole), mujoco.MjData(model)
        states = []
        try:
            for state in self._states:
                mujoco.mj_setState(whole, data, state, STATE)
                transfer(whole, data, left, model, other)
                states.append(full_state(model, other))
            one, two = Stepped(whole, data, self._states), Stepped(model, other, states)
            found = time_ratio(one, two, self.clock, quick=self.quick)
        except (ValueError, mujoco.FatalError):
            return None
        return None if found is None else Ratio(found.ratio, found.uncertainty)

    @cached_property
    def _states(self) -> list[Any]:
        """States of the original, from which steps are timed."""
        model = self.scene.model
        setups = [case.setup for case in self.cases]
        return [s for one in setups for s in moments(model, initial_data(one, model), one)]

    def saving(self, trial: PruningTrial, ratio: Ratio | None) -> Saving:
        """What a change saves, in time and bytes."""
        files = self.scene.files(trial.edits)
        before = {one.path: len(one.data) for one in self.scene.documents}
        text = sum(before[path] - len(data) for path, data in files.items())
        memory = len(saved(self.scene.model)) - len(saved(trial.model))
        if ratio is None:
            return Saving(None, None, False, memory, text)
        return Saving(ratio.value, ratio.spread, ratio.certain, memory, text)


# ----------------------------------------------------------------------------------------- changes


def change(scene: ModelText, items: Iterable[Item]) -> tuple[tuple[ModelEdit, ...], Gone]:
    """All the edits that items make together, and what they take out of the compiled model."""
    some = list(items)
    gone = list(dict.fromkeys(one for item in some for one in item.gone))
    below = [one for element in gone for one in element.walk()]
    lost = Gone(
        scene.ids_of(below, "body"),
        scene.ids_of(below, "geom"),
        scene.ids_of(below, "sensor"),
        scene.ids_of(below, "actuator"),
    )
    edits = [*remove(gone), *_keyframes(scene, lost, set(below))]
    edits += [edit for item in some for edit in item.edits]
    options = dict(pair for item in some for pair in item.options)
    flags = dict(pair for item in some for pair in item.flags)
    if options or flags:
        edits += set_options(scene.main, tuple(options.items()), tuple(flags.items()))
    return _outermost(edits), lost


def _outermost(edits: Iterable[ModelEdit]) -> tuple[ModelEdit, ...]:
    """Without those inside of what another one takes out."""
    some = sorted(set(edits), key=lambda one: (one.path, one.start, -one.end))
    found: list[ModelEdit] = []
    for edit in some:
        last = found[-1] if found else None
        inside = last is not None and last.path == edit.path and not last.new
        if last is None or not (inside and last.start <= edit.start and edit.end <= last.end):
            found.append(edit)
    return tuple(found)


def _keyframes(scene: ModelText, gone: Gone, removed: set[Element]) -> Sequence[ModelEdit]:
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
    keys = [one for one in scene.elements if one.tag == "key" and one not in removed]
    return [e for key in keys for name, at in places.items() for e in drop_numbers(key, name, at)]
