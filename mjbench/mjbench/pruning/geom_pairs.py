"""Between which geoms MuJoCo looks for contact.

It does not look within a body, nor between bodies that are welded to each other or do not move,
between parent and child, where masks forbid it, or where an `exclude` says so; and it does between
those of a `pair`. This is repeated here.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import mujoco
import numpy as np

Pair = tuple[int, int]


def possible_pairs(model: Any) -> frozenset[Pair]:
    """The pairs of geoms between which MuJoCo looks for contact when they are near each other."""
    return frozenset(iterate_pairs(model))


def iterate_pairs(model: Any) -> Iterator[Pair]:
    """The same pairs one after the other, as there may be many; some come twice."""
    flags = int(model.opt.disableflags)
    disabling = mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    if flags & int(disabling):
        return
    for first, second in zip(model.pair_geom1, model.pair_geom2, strict=True):
        yield min(int(first), int(second)), max(int(first), int(second))
    parents = not flags & int(mujoco.mjtDisableBit.mjDSBL_FILTERPARENT)
    excluded = {int(weld_a) for weld_a in model.exclude_signature}
    weld = model.body_weldid
    weld_parents = weld[model.body_parentid[weld]]
    moves = [False] * model.nbody
    for number in range(1, model.nbody):
        has_joint = bool(model.body_dofnum[number])
        moves[number] = has_joint or moves[int(model.body_parentid[number])]
    kind, affinity = model.geom_contype, model.geom_conaffinity
    body = model.geom_bodyid
    for a in range(model.ngeom):
        may_touch = ((kind[a] & affinity[a + 1 :]) | (kind[a + 1 :] & affinity[a])) != 0
        for b in (np.nonzero(may_touch)[0] + a + 1).tolist():
            weld_a, weld_b = int(weld[body[a]]), int(weld[body[b]])
            if weld_a == weld_b or not (moves[weld_a] or moves[weld_b]):
                continue
            if (
                parents
                and weld_a
                and weld_b
                and (weld_parents[weld_a] == weld_b or weld_parents[weld_b] == weld_a)
            ):
                continue
            low, high = sorted((int(body[a]), int(body[b])))
            if (low << 16) + high in excluded or (high << 16) + low in excluded:
                continue
            yield a, b
