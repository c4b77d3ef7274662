"""Between which geoms MuJoCo looks for contact, and how far a shape is from a mesh in its place.

It does not look within a body, nor between bodies that are welded to each other or do not move,
between parent and child, where masks forbid it, or where an `exclude` says so; and it does between
those of a `pair`. This is repeated here.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

Pair = tuple[int, int]
Vector = NDArray[np.float64]


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


def mesh_vertices(model: Any, mesh: int) -> Vector:
    """The vertices (n, 3) of a mesh, in its own frame, m."""
    first = int(model.mesh_vertadr[mesh])
    vertices: Vector = model.mesh_vert[first : first + int(model.mesh_vertnum[mesh])]
    return vertices.astype(np.float64)


def hull_distance(model: Any, variant: Any, geom: int) -> float:
    """How far the surface of a mesh's hull is, at most, from that of a shape in its place, m.

    Of convex bodies that is the largest difference of how far they extend in a direction.
    """
    mesh, random, spread = int(model.geom_dataid[geom]), np.random.default_rng(0), 1.0
    first, count = int(model.mesh_polyadr[mesh]), int(model.mesh_polynum[mesh])
    faces = model.mesh_polynormal[first : first + count].astype(np.float64)
    directions, worst, largest = faces @ _turn(model, geom).T, np.zeros(3), 0.0
    for _ in range(_ROUNDS):  # all about, then ever nearer to the worst
        directions = np.concatenate([directions, worst + spread * random.normal(size=(_RAYS, 3))])
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        gaps = np.abs(_extent(model, geom, directions) - _extent(variant, geom, directions))
        worst, largest = directions[gaps.argmax()], max(largest, float(gaps.max()))
        directions, spread = worst[None], spread / 3
    return largest


_ROUNDS, _RAYS = 6, 1000
"""How often directions are drawn, and how many each time."""


def _turn(model: Any, geom: int) -> Vector:
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, model.geom_quat[geom])
    return turn.reshape(3, 3)


def _extent(model: Any, geom: int, directions: Vector) -> Vector:
    """How far a geom extends from the origin of its body in directions (n, 3), m."""
    size, local = model.geom_size[geom], directions @ _turn(model, geom)
    sides = np.hypot(local[:, 0], local[:, 1])
    match mujoco.mjtGeom(int(model.geom_type[geom])):
        case mujoco.mjtGeom.mjGEOM_SPHERE:
            reach = np.full(len(local), size[0])
        case mujoco.mjtGeom.mjGEOM_CAPSULE:
            reach = size[0] + size[1] * np.abs(local[:, 2])
        case mujoco.mjtGeom.mjGEOM_CYLINDER:
            reach = size[0] * sides + size[1] * np.abs(local[:, 2])
        case mujoco.mjtGeom.mjGEOM_BOX:
            reach = np.abs(local) @ size
        case mujoco.mjtGeom.mjGEOM_ELLIPSOID:
            reach = np.linalg.norm(local * size, axis=1)
        case _:
            vertices = mesh_vertices(model, int(model.geom_dataid[geom]))
            reach = (local @ vertices.T).max(axis=1)
    return np.asarray(directions @ model.geom_pos[geom] + reach)
