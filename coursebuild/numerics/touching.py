"""Which geoms of a model may touch, and which do.

Entry points: `possible_pairs`; `touched_pairs(model, scenes)`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np

from coursebuild.numerics.engine import advance, begun, held
from coursebuild.numerics.pilot import Bounded
from coursebuild.numerics.problem import Scenario, whole_number
from coursebuild.numerics.pruning.reach import Pair
from coursebuild.numerics.pruning.reach import possible_pairs as possible_pairs
from coursebuild.numerics.scene import Scene


def touched_pairs(model: Any, scenes: Iterable[Scene]) -> frozenset[Pair]:
    """Pairs of geoms with a contact that counts, in any scenario, with the model's own setting.

    A run ends where it is lost: what touches after that says nothing.
    """
    found: set[Pair] = set()
    for scene in scenes:
        found |= _touched(model, scene.scenario, scene.own)
    return frozenset(found)


def _touched(model: Any, scenario: Scenario, timestep: float) -> set[Pair]:
    setup = Bounded(scenario, math.inf, math.inf)
    data = begun(setup, model)
    every = whole_number(scenario.sample, timestep, "the sampling interval", "the timestep")
    holds, rows = held(setup), scenario.controls
    found: set[Pair] = set()
    for look in range(len(scenario.times)):
        if rows:
            data.ctrl[:] = rows[min(look // holds, len(rows) - 1)]
        for _ in range(every):
            before = data.time
            advance(model, data)
            if not data.time > before:  # it was lost, and reset
                return found
            if data.ncon:
                geoms = np.sort(data.contact.geom[data.contact.exclude == 0], axis=1)
                found |= {(int(a), int(b)) for a, b in np.unique(geoms, axis=0) if a >= 0}
    return found
