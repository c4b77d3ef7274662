"""A model without some things: compiled, compared with the whole model, run and timed beside it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import cached_property
from typing import Any, TypeVar

import mujoco
import numpy as np
from msgspec import Struct

from mjbench.costs import Clock, Job, Timing, scenario_job, time_jobs
from mjbench.pruning.candidates import KINDS, Item
from mjbench.pruning.comparison import (
    KEY_SIZES,
    IndexMap,
    MotionComparison,
    WatchedRun,
    compare,
    fits,
    index_map,
    transfer,
    without_reset,
)
from mjbench.pruning.model_text import ModelText, model_bytes
from mjbench.pruning.readers import difference
from mjbench.pruning.xml_edits import (
    ModelEdit,
    drop_attribute,
    drop_numbers,
    find_emptied,
    merge_edits,
    remove_elements,
)
from mjbench.reports.diet_report import Finding, Saving
from mjbench.scene import Scene
from mjbench.simulation import STATE, advance, full_state, initial_data, silent

_T = TypeVar("_T")
_DRAWS = 2
"""Random states in which two models are compared."""


def largest_subset(items: Sequence[_T], holds: Callable[[list[_T]], bool]) -> list[_T]:
    """A largest subset of the items for which something holds, by delta debugging.

    All items are tried first, then halves, each together with the subset so far, until it grows no
    more. In the end no single item can be added.
    """
    subset: list[_T] = []

    def add(candidates: Sequence[_T]) -> None:
        if holds([*subset, *candidates]):
            subset.extend(candidates)
        elif len(candidates) > 1:
            add(candidates[: len(candidates) // 2])
            add(candidates[len(candidates) // 2 :])

    left = list(items)
    while left:
        before = len(subset)
        add(left)
        left = [item for item in left if item not in subset]
        if len(subset) == before:
            break
    return subset


class PrunedModel(Struct, frozen=True, eq=False):
    """A model without some things."""

    edits: tuple[ModelEdit, ...]
    model: Any
    index: IndexMap


class PrunedGroup(Struct, frozen=True, eq=False):
    """Items that are taken out together, with the finding about them."""

    items: tuple[Item, ...]
    finding: Finding


def views_of(items: Iterable[Item]) -> frozenset[str]:
    """The kinds of things that items are to code."""
    return frozenset(KINDS[item.kind].view for item in items) - {""}


class PruningTrials(Struct, eq=False, dict=True):
    """Tries a model without some things."""

    text: ModelText
    runs: tuple[WatchedRun, ...]
    """In the scenarios in which the whole model was not lost, and from starts nearby."""
    scenes: tuple[Scene, ...]
    """These scenarios."""
    clock: Clock | None
    quick: bool
    absences: tuple[Item, ...] = ()
    """What is gone for good, so that more is tried in what is left, which may be far less."""

    @cached_property
    def whole(self) -> PrunedModel:
        """The model as it is."""
        return PrunedModel((), self.text.model, index_map(self.text.model, {}))

    def prune(self, items: Iterable[Item]) -> PrunedModel | None:
        """The model without these items; `None` if it does not compile, or differs otherwise."""
        try:
            edits, index = _changes(self.text, list(items))
            model = self.text.compile(edits)
        except ValueError:
            return None
        without_reset(model)
        return PrunedModel(edits, model, index) if fits(index, self.text.model, model) else None

    def edits(self, items: Iterable[Item]) -> tuple[ModelEdit, ...]:
        """The edits that take items out."""
        return _changes(self.text, list(items))[0]

    def _count_saved_bytes(self, edits: Iterable[ModelEdit]) -> int:
        """The number of bytes by which edits shorten the text."""
        before = {document.path: len(document.data) for document in self.text.documents}
        files = self.text.files(edits)
        return sum(before[path] - len(data) for path, data in files.items())

    def compare(self, trial: PrunedModel, base: PrunedModel) -> MotionComparison | None:
        """Compare two parts of the model in all runs; `None` where that is not possible."""
        remainder = base.model, base.index
        try:
            return compare(self.text.model, trial.model, trial.index, self.runs, remainder)
        except (ValueError, mujoco.FatalError):
            return None

    def difference(self, trial: PrunedModel, base: PrunedModel) -> frozenset[str]:
        """The fields by which code could tell both apart, in the models and in some states."""
        fields = difference(base.model, trial.model)
        for state in self._states:
            data = mujoco.MjData(self.text.model)
            mujoco.mj_setState(self.text.model, data, state, STATE)
            base_data, trial_data = self._part(data, base), self._part(data, trial)
            advance(base.model, base_data)
            advance(trial.model, trial_data)
            fields |= difference(base_data, trial_data)
        return fields

    def _part(self, data: Any, part: PrunedModel) -> Any:
        """A state of the whole model in a part of it."""
        part_data = mujoco.MjData(part.model)
        transfer(self.text.model, data, part.index, part.model, part_data)
        return part_data

    @cached_property
    def _states(self) -> list[Any]:
        """The initial state of the first scenario, and random states around it."""
        model, scenario, states = self.text.model, self.scenes[0].scenario, []
        random = np.random.default_rng(0)
        for draw in range(1 + _DRAWS):
            data = initial_data(scenario, model)
            if draw:
                mujoco.mj_integratePos(model, data.qpos, random.normal(size=model.nv), 0.3)
                data.qvel[:] += random.normal(size=model.nv)
            states.append(full_state(model, data))
        return states

    def measure_saving(
        self,
        edits: Iterable[ModelEdit],
        trial: PrunedModel | None,
        base: PrunedModel,
        *,
        timed: bool = True,
    ) -> Saving:
        """Measure the saving of a change, in time and bytes; `None`: it does not go alone."""
        if trial is None:
            return Saving(None, None, False, 0, self._count_saved_bytes(edits))
        text = self._count_saved_bytes(trial.edits) - self._count_saved_bytes(base.edits)
        memory = len(model_bytes(base.model)) - len(model_bytes(trial.model))
        timing = self._measure_time(trial, base) if timed else None
        if timing is None:
            return Saving(None, None, False, memory, text)
        ratio = timing.ratio
        return Saving(ratio.value, ratio.half_width / 2, timing.certain, memory, text)

    def _measure_time(self, trial: PrunedModel, base: PrunedModel) -> Timing | None:
        """Time of one part of the model over that of another, in whole scenarios."""
        if self.clock is None:
            return None
        try:
            jobs = [self._job(base), self._job(trial)]
        except ValueError:
            return None
        with silent():
            base_time, trial_time = time_jobs(jobs, 1, self.clock, quick=self.quick)
        can_tell = min(base_time.nanoseconds.low, trial_time.nanoseconds.low) > 0
        return base_time if can_tell else None

    def _job(self, part: PrunedModel) -> Job:
        """All scenarios in a part of the model."""
        scenarios = [scene.scenario for scene in self.scenes]
        starts = [initial_data(scenario, self.text.model) for scenario in scenarios]
        states = [full_state(part.model, self._part(start, part)) for start in starts]
        actuators, timestep = part.index["nu"].tolist(), self.scenes[0].timestep
        return scenario_job(part.model, scenarios, timestep, states=states, actuators=actuators)


def _changes(text: ModelText, items: Sequence[Item]) -> tuple[tuple[ModelEdit, ...], IndexMap]:
    """All edits of items together, and what they leave of the compiled model."""
    elements = list(dict.fromkeys(element for item in items for element in item.removals))
    nodes = [node for element in elements for node in element.walk()]
    kinds = ("body", "joint", "geom", "sensor", "actuator", "equality")
    index = index_map(text.model, {kind: text.ids_of(nodes, kind) for kind in kinds})
    drops = [drop for item in items for drop in item.drops]
    edits = [edit for item in items for edit in item.edits]
    edits += remove_elements([*elements, *find_emptied(drops, edits)])
    edits += [drop_attribute(*drop) for drop in drops]
    node_set = set(nodes)
    for name, size in KEY_SIZES.items():  # keyframes list a number for each coordinate
        lost = set(range(getattr(text.model, size))).difference(index[size].tolist())
        for key in text.elements:
            if key.tag == "key" and key not in node_set:
                edits += drop_numbers(key, name, lost)
    return merge_edits(edits), index
