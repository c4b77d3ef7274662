"""A model without some things: compiled, compared with the whole one, run and timed beside it.

Entry points: `PruningTrials`, which makes a `PrunedModel`; `largest_subset(items, holds)`.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from functools import cached_property
from typing import Any, TypeVar

import mujoco
import numpy as np
from msgspec import Struct

from coursebuild.numerics.engine import STATE, advance, full_state, initial_data, silent
from coursebuild.numerics.pruning.candidates import Item
from coursebuild.numerics.pruning.compare import MotionComparison, compare, without_reset
from coursebuild.numerics.pruning.differences import difference
from coursebuild.numerics.pruning.edits import (
    ModelEdit,
    drop_attribute,
    drop_numbers,
    emptied,
    merge_edits,
    remove,
)
from coursebuild.numerics.pruning.index_map import IndexMap, Removal, fits, index_map, transfer
from coursebuild.numerics.pruning.markup import Element
from coursebuild.numerics.pruning.model_text import ModelText, model_bytes
from coursebuild.numerics.reports.diet import Saving
from coursebuild.numerics.scene import Scene
from coursebuild.numerics.timing import Clock, Timing, scenario_job, time_jobs

_T = TypeVar("_T")
_KEY_NUMBERS = {"qpos": "nq", "qvel": "nv", "act": "na", "ctrl": "nu"}
"""Of each attribute of a keyframe, what it has numbers for; a mocap body never goes."""
_DRAWS = 2
"""Random states in which two models are compared."""


def largest_subset(items: Sequence[_T], holds: Callable[[list[_T]], bool]) -> list[_T]:
    """Most of the items for which something holds together, by delta debugging.

    All of them are tried first, then halves, each together with what was found before; again, until
    no more are found. In the end no single one can be added.
    """
    found: list[_T] = []

    def add(some: Sequence[_T]) -> None:
        if holds([*found, *some]):
            found.extend(some)
        elif len(some) > 1:
            add(some[: len(some) // 2])
            add(some[len(some) // 2 :])

    left = list(items)
    while left:
        before = len(found)
        add(left)
        left = [one for one in left if one not in found]
        if len(found) == before:
            break
    return found


class PrunedModel(Struct, frozen=True, eq=False):
    """A model without some things."""

    edits: tuple[ModelEdit, ...]
    model: Any
    index: IndexMap


class PruningTrials:
    """Tries a model without things."""

    def __init__(
        self, text: ModelText, scenes: Sequence[Scene], clock: Clock | None, *, quick: bool
    ) -> None:
        self.text = text
        self.scenes = scenes
        self.clock = clock
        self.quick = quick

    def without(self, items: Iterable[Item]) -> PrunedModel | None:
        """The model without these; `None` where that is no model, or not the one it should be."""
        text = self.text
        try:
            edits, gone = _changes(text, list(items))
            index, model = index_map(text.model, gone), text.compiled(edits)
        except ValueError:
            return None
        without_reset(model)
        return PrunedModel(edits, model, index) if fits(index, text.model, model) else None

    def edits(self, items: Iterable[Item]) -> tuple[ModelEdit, ...]:
        """The changes that take these out."""
        return _changes(self.text, list(items))[0]

    def bytes_of(self, edits: Iterable[ModelEdit]) -> int:
        """Bytes that changes take out of the text."""
        before = {one.path: len(one.data) for one in self.text.documents}
        files = self.text.files(edits)
        return sum(before[path] - len(data) for path, data in files.items())

    def compare(self, trial: PrunedModel) -> MotionComparison | None:
        """How it does in all scenarios; `None` where that cannot be told."""
        try:
            return compare(self.text.model, trial.model, trial.index, self.scenes)
        except (ValueError, mujoco.FatalError):
            return None

    def state_difference(self, trial: PrunedModel) -> frozenset[str]:
        """By what code could tell both apart in some states of the whole model."""
        whole: Any = self.text.model
        found: frozenset[str] = frozenset()
        for state in self._states:
            data, other = mujoco.MjData(whole), mujoco.MjData(trial.model)
            mujoco.mj_setState(whole, data, state, STATE)
            transfer(whole, data, trial.index, trial.model, other)
            advance(whole, data)
            advance(trial.model, other)
            found |= difference(data, other)
        return found

    @cached_property
    def _states(self) -> list[Any]:
        """Where the first scenario begins, and states that are drawn from there."""
        model, scenario, found = self.text.model, self.scenes[0].scenario, []
        random = np.random.default_rng(0)
        for draw in range(1 + _DRAWS):
            data = initial_data(scenario, model)
            if draw:
                mujoco.mj_integratePos(model, data.qpos, random.normal(size=model.nv), 0.3)
                data.qvel[:] += random.normal(size=model.nv)
            found.append(full_state(model, data))
        return found

    def saving(self, trial: PrunedModel, *, timed: bool = True) -> Saving:
        """What a change saves, in time and bytes."""
        text = self.bytes_of(trial.edits)
        memory = len(model_bytes(self.text.model)) - len(model_bytes(trial.model))
        timing = self._timing(trial) if timed else None
        if timing is None:
            return Saving(None, None, False, memory, text)
        ratio = timing.ratio
        return Saving(ratio.value, ratio.half_width / 2, timing.certain, memory, text)

    def _timing(self, trial: PrunedModel) -> Timing | None:
        """Time of the whole model over that of this one, in whole scenarios."""
        if self.clock is None:
            return None
        whole, index, begins, others = self.text.model, trial.index, [], []
        try:
            for scene in self.scenes:
                data, other = initial_data(scene.scenario, whole), mujoco.MjData(trial.model)
                transfer(whole, data, index, trial.model, other)
                begins.append((scene.scenario, full_state(whole, data)))
                others.append((scene.scenario, full_state(trial.model, other)))
        except ValueError:
            return None
        jobs = (
            scenario_job(whole, begins, self.scenes[0].timestep),
            scenario_job(trial.model, others, self.scenes[0].timestep, index["nu"].tolist()),
        )
        with silent():
            found, own = time_jobs(jobs, 1, self.clock, quick=self.quick)
        return found if min(found.nanoseconds.low, own.nanoseconds.low) > 0 else None


def _changes(text: ModelText, items: Sequence[Item]) -> tuple[tuple[ModelEdit, ...], Removal]:
    """All the edits that items make together, and what they take out of the compiled model."""
    elements = list(dict.fromkeys(one for item in items for one in item.gone))
    below = [one for element in elements for one in element.walk()]
    gone = Removal(*(text.ids_of(below, kind) for kind in ("body", "geom", "sensor", "actuator")))
    drops = [drop for item in items for drop in item.drops]
    edits = [edit for item in items for edit in item.edits]
    edits += remove([*elements, *emptied(drops, edits)])
    edits += [drop_attribute(*drop) for drop in drops]
    edits += _keyframes(text, gone, set(below))
    return merge_edits(edits), gone


def _keyframes(text: ModelText, gone: Removal, removed: Collection[Element]) -> Iterator[ModelEdit]:
    """Keyframes list a number for every coordinate: those of what is gone go too."""
    if not (gone.bodies or gone.actuators):
        return
    left = index_map(text.model, gone)
    for name, size in _KEY_NUMBERS.items():
        lost = set(range(getattr(text.model, size))) - set(left[size].tolist())
        for key in text.elements:
            if key.tag == "key" and key not in removed:
                yield from drop_numbers(key, name, lost)
