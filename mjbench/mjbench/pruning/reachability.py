"""Which geoms can never touch, whatever happens: a bound, not an observation; which enclose others.

1. MuJoCo looks for contact between geoms whose masks allow it, but not within a body, nor between
   bodies that are welded to each other or do not move, between parent and child, or where an
   `exclude` says so; and it does between those of a `pair`. This is repeated here.
2. Two geoms are compared in the frame of the nearest body that carries both. A point below it can
   be no farther from the anchor of the first joint than the sum of the distances from anchor to
   anchor, whatever angles the joints take; limits do not count, as they are soft. After a single
   joint it cannot be nearer either.
3. A free body, a slide and a mocap body can be anywhere.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator
from typing import Any

import mujoco
import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

_PLANE = int(mujoco.mjtGeom.mjGEOM_PLANE)
_HFIELD = int(mujoco.mjtGeom.mjGEOM_HFIELD)
_FREE_JOINT, _SLIDE_JOINT = int(mujoco.mjtJoint.mjJNT_FREE), int(mujoco.mjtJoint.mjJNT_SLIDE)
_SLACK = 1e-6
"""m and relative: rounding, and the engine's own margins."""

PREMISES = frozenset(
    "geom_contype geom_conaffinity geom_bodyid geom_margin geom_gap geom_type geom_dataid geom_pos"
    " geom_quat geom_size geom_rbound geom_aabb geom_sameframe body_parentid body_rootid"
    " body_weldid body_mocapid body_jntnum body_jntadr body_dofnum body_pos body_quat"
    " body_sameframe body_contype body_conaffinity body_margin jnt_type jnt_bodyid jnt_qposadr"
    " jnt_pos jnt_axis pair_geom1 pair_geom2 pair_margin pair_gap exclude_signature mesh_vert"
    " hfield_data hfield_size qpos0 qpos_spring disableflags o_margin".split(" ")
)
"""Fields of a model that the bound depends on: where code may change one, it does not hold."""

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


class Shell(Struct, frozen=True, eq=False):
    """All points whose distance from a centre is in a range, m; in the frame of some body."""

    centre: Vector
    least: float
    most: float


class Reach:
    """The bounds of a model's geoms, computed in its own state."""

    def __init__(self, model: Any) -> None:
        self._model = model
        self._data = data = mujoco.MjData(model)
        data.qpos[:] = model.qpos0
        mujoco.mj_kinematics(model, data)
        self._ancestries = [self._ancestry(b) for b in range(model.nbody)]
        self._shells: dict[Pair, Shell | None] = {}
        # What adheres pulls across its gap; an override comes instead of all margins.
        pair_margins = model.pair_margin + model.pair_gap
        self._pair_margin = float(np.max(pair_margins, initial=model.opt.o_margin))
        self._margins = model.geom_margin + model.geom_gap

    def _ancestry(self, body: int) -> list[int]:
        """A body and its ancestors, up to the world."""
        bodies = [body]
        while body:
            body = int(self._model.body_parentid[body])
            bodies.append(body)
        return bodies

    def are_separate(self, a: int, b: int) -> bool:
        """Whether two geoms can never touch."""
        model = self._model
        body_a, body_b = int(model.geom_bodyid[a]), int(model.geom_bodyid[b])
        ancestors = set(self._ancestries[body_b])
        common = next(body for body in self._ancestries[body_a] if body in ancestors)
        margin = float(self._margins[a] + self._margins[b]) + self._pair_margin
        gap = margin + _SLACK * (1.0 + margin)
        first, second = self.shell(a, common), self.shell(b, common)
        if first is None or second is None:
            return False
        if _PLANE in (model.geom_type[a], model.geom_type[b]):
            return self._stays_off_plane(a, b, first, second, gap)
        if not (self._has_size(a) and self._has_size(b)):
            return False
        distance = float(np.linalg.norm(first.centre - second.centre))
        gap += _SLACK * (distance + first.most + second.most)
        return (
            distance > first.most + second.most + gap
            or first.least > distance + second.most + gap
            or second.least > distance + first.most + gap
        )

    def _has_size(self, geom: int) -> bool:
        return float(self._model.geom_rbound[geom]) > 0

    def _stays_off_plane(self, a: int, b: int, first: Shell, second: Shell, gap: float) -> bool:
        """Whether a geom stays in front of a plane that is fixed to the common body."""
        model = self._model
        if model.geom_type[a] == model.geom_type[b]:
            return True  # planes do not touch each other
        plane, shell, plane_shell = b, first, second
        if model.geom_type[a] == _PLANE:
            plane, shell, plane_shell = a, second, first
        if plane_shell.most > 0 or not self._has_size(b if plane == a else a):
            return False
        if not self._is_fixed(int(model.geom_bodyid[plane])):
            # Its normal is known in the world only; a plane that moves is left out.
            return False
        normal = self._data.geom_xmat[plane].reshape(3, 3)[:, 2]
        height = float(normal @ (shell.centre - self._data.geom_xpos[plane]))
        return height > shell.most + gap + _SLACK * (abs(height) + shell.most)

    def _is_fixed(self, body: int) -> bool:
        model, ancestors = self._model, self._ancestries[body]
        return int(model.body_weldid[body]) == 0 and not np.any(model.body_mocapid[ancestors] >= 0)

    def shell(self, geom: int, common: int) -> Shell | None:
        """The shell in which a geom stays, relative to a body that carries it, in axes of `qpos0`.

        A plane counts as a point. `None`: it can be anywhere.
        """
        if (geom, common) not in self._shells:
            self._shells[geom, common] = self._shell(geom, common)
        return self._shells[geom, common]

    def _shell(self, geom: int, common: int) -> Shell | None:
        model, data = self._model, self._data
        point = np.asarray(data.geom_xpos[geom], dtype=np.float64)
        line = self._ancestries[int(model.geom_bodyid[geom])]
        size = 0.0 if model.geom_type[geom] == _PLANE else self._radius(geom)
        anchors: list[Vector] = []
        for body in reversed(line[: line.index(common)]):
            if int(model.body_mocapid[body]) >= 0:
                return None
            start = int(model.body_jntadr[body])
            for joint in range(start, start + int(model.body_jntnum[body])):
                if model.jnt_type[joint] in (_FREE_JOINT, _SLIDE_JOINT):
                    return None
                anchors.append(np.asarray(data.xanchor[joint], dtype=np.float64))
        if not anchors:
            return Shell(point, 0.0, size)
        legs = [float(np.linalg.norm(q - p)) for p, q in itertools.pairwise([*anchors, point])]
        least = max(0.0, legs[0] - size) if len(legs) == 1 else 0.0
        return Shell(anchors[0], least, sum(legs) + size)

    def _radius(self, geom: int) -> float:
        """The radius of a geom about its own position; a mesh or field may lie beside it."""
        model = self._model
        radius, box = float(model.geom_rbound[geom]), model.geom_aabb[geom]
        if model.geom_type[geom] == _HFIELD:
            return radius
        return max(radius, float(np.linalg.norm(np.abs(box[:3]) + box[3:])))


def find_separate(model: Any, pairs: Iterable[Pair]) -> frozenset[Pair]:
    """The pairs of geoms, of these, that can never touch."""
    reach = Reach(model)
    return frozenset(pair for pair in pairs if reach.are_separate(*pair))


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
            mesh = model.mesh(int(model.geom_dataid[geom]))
            first, count = int(mesh.vertadr[0]), int(mesh.vertnum[0])
            reach = (local @ model.mesh_vert[first : first + count].T).max(axis=1)
    return np.asarray(directions @ model.geom_pos[geom] + reach)
