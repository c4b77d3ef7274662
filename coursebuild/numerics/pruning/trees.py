"""Bodies of a model that move together, what they sweep, and what refers to them.

Entry points: `Trees`, `References`, `Bounds`.

`Trees.focus` are those that the scene is about: the driven, measured, coupled, those set in motion
or named by a lesson; where there is none, those with a sensor, else mechanisms, else what has a
name.
"""

from __future__ import annotations

from collections.abc import Iterable

import mujoco
import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from coursebuild.numerics.pruning.markup import Element
from coursebuild.numerics.pruning.model_text import is_repeated
from coursebuild.numerics.pruning.trials import PruningContext
from coursebuild.numerics.pruning.unused import unread_sensors

Vector = NDArray[np.float64]

_NOT_REFERENCES = frozenset(("name", "class", "childclass", "material", "mesh", "file", "type"))


class Bounds(Struct, frozen=True, eq=False):
    """A region, along the axes of the world."""

    low: Vector
    high: Vector

    @property
    def size(self) -> float:
        """Its diagonal, m."""
        return float(np.linalg.norm(self.high - self.low))

    def distance(self, other: Bounds) -> float:
        """Between the nearest points of two, m."""
        gap = np.maximum(0.0, np.maximum(self.low - other.high, other.low - self.high))
        return float(np.linalg.norm(gap))


class Trees:
    """Bodies that move together: each by the body at its root."""

    def __init__(self, look: PruningContext, references: References) -> None:
        self.look = look
        self.references = references
        self.model = model = look.model
        self.of_body = [-1] * model.nbody
        """The root of the tree that a body is in; −1 for what is fixed to the world."""
        for body in range(1, model.nbody):
            above = self.of_body[int(model.body_parentid[body])]
            moves = model.body_jntnum[body] > 0 or model.body_mocapid[body] >= 0
            self.of_body[body] = above if above >= 0 else body if moves else -1
        self.bodies: dict[int, list[int]] = {}
        for body, root in enumerate(self.of_body):
            if root >= 0:
                self.bodies.setdefault(root, []).append(body)
        self.roots = frozenset(self.bodies)
        self.of_dof = np.array([self.of_body[int(b)] for b in model.dof_bodyid], dtype=np.int64)
        self.of_geom = [self.of_body[int(b)] for b in model.geom_bodyid]
        self.touching = frozenset(pair for seen in look.seen for pair in seen.touching)
        self.touched = frozenset(geom for pair in self.touching for geom in pair)
        data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, data)
        self.place = np.asarray(data.geom_xpos, dtype=np.float64)
        """(ngeom, 3) m: right for geoms that are fixed to the world."""
        self._elements: dict[int, list[Element]] = {root: [] for root in self.roots}
        for element in look.scene.elements:
            thing = look.scene.ids(element)
            if thing is None or thing.kind not in ("body", "joint", "geom", "site"):
                continue
            for root in {self.of_body[self._body(thing.kind, i)] for i in thing.ids} - {-1}:
                self._elements[root].append(element)

    def _body(self, kind: str, number: int) -> int:
        model = self.model
        if kind == "body":
            return number
        ids = {"joint": model.jnt_bodyid, "geom": model.geom_bodyid, "site": model.site_bodyid}
        return int(ids[kind][number])

    def focus(self) -> frozenset[int]:
        """The trees that the scene is about, and what touches them."""
        if self.model.nflex:
            return self.roots
        found = {root for root in self.roots if self._matters(root)} | self._thrown()
        for likely in (self._sensed, self._jointed, self._named):
            if not found:
                found = {root for root in self.roots if likely(root)}
        size = 0
        while size < len(found):
            size = len(found)
            for a, b in self.touching:
                pair = {self.of_geom[a], self.of_geom[b]} - {-1}
                if len(pair) == 2 and pair & found:
                    found |= pair
        return frozenset(found)

    def _thrown(self) -> set[int]:
        """Those that a scenario sets in motion."""
        found: set[int] = set()
        for case in (seen.case.scenario for seen in self.look.seen):
            velocity = np.array(case.qvel)
            if not case.qvel and case.keyframe >= 0:
                velocity = self.model.key_qvel[case.keyframe]
            found |= set(self.of_dof[np.nonzero(velocity)[0]].tolist())
        return found

    def is_rubble(self, root: int) -> bool:
        """Whether it is one free body to which nobody gave a name."""
        return not (self._jointed(root) or self._named(root))

    def _sensed(self, root: int) -> bool:
        return bool(self.references.of(self._elements[root]).loose)

    def _jointed(self, root: int) -> bool:
        """Whether it is more than one free body."""
        first = int(self.model.body_jntadr[root])
        free = self.model.jnt_type[first] == int(mujoco.mjtJoint.mjJNT_FREE)
        return len(self.bodies[root]) > 1 or not free

    def _named(self, root: int) -> bool:
        return any(one.get("name") for one in self._elements[root] if one.tag == "body")

    def _matters(self, root: int) -> bool:
        if any(int(self.model.body_mocapid[b]) >= 0 for b in self.bodies[root]):
            return True
        elements = self._elements[root]
        names = {one.get("name") for one in elements} - {None, ""}
        if any(self.look.readers.named(str(name)) for name in names):
            return True
        return bool(self.references.of(elements).others)

    def region(self, roots: Iterable[int]) -> Bounds:
        """What trees sweep in all the runs."""
        bodies = [b for root in roots for b in self.bodies[root]]
        sizes = np.array([self._size(b) for b in bodies])[:, None]
        low = np.min([s.low[bodies] - sizes for s in self.look.seen], axis=(0, 1))
        high = np.max([s.high[bodies] + sizes for s in self.look.seen], axis=(0, 1))
        return Bounds(low, high)

    def way(self, root: int) -> float:
        """How far a tree's bodies go in a run, m."""
        bodies = self.bodies[root]
        return max(
            float(np.max(np.linalg.norm(s.high[bodies] - s.low[bodies], axis=1)))
            for s in self.look.seen
        )

    def _size(self, body: int) -> float:
        """Of a ball about the body's centre of mass that holds its geoms, m."""
        model = self.model
        start, count = int(model.body_geomadr[body]), int(model.body_geomnum[body])
        most = 0.0
        for geom in range(start, start + count):
            away = float(np.linalg.norm(model.geom_pos[geom] - model.body_ipos[body]))
            most = max(most, away + float(model.geom_rbound[geom]))
        return most


class Referring(Struct, frozen=True, eq=False):
    """What refers to some elements."""

    loose: tuple[Element, ...]
    """What would go with them: unread sensors, excluded and explicit pairs."""
    others: tuple[Element, ...]
    """What needs them."""


class References:
    """Which elements refer to which names."""

    def __init__(self, look: PruningContext) -> None:
        self._unread = set(unread_sensors(look))
        self._by_name: dict[str, list[Element]] = {}
        for element in look.scene.elements:
            for one in element.attributes:
                if one.name not in _NOT_REFERENCES:
                    self._by_name.setdefault(one.value, []).append(element)

    def _naming(self, element: Element) -> list[Element]:
        name = element.get("name")
        if not name:
            return []
        found = self._by_name.get(name, [])
        if is_repeated(element):
            longer = (key for key in self._by_name if key.startswith(name) and key[-1].isdigit())
            found = [*found, *(one for key in longer for one in self._by_name[key])]
        return found

    def of(self, elements: Iterable[Element]) -> Referring:
        """What refers to elements by their names, from outside of them."""
        below = [one for element in elements for one in element.walk()]
        inside = set(below)
        loose: list[Element] = []
        others: list[Element] = []
        for one in below:
            for element in self._naming(one):
                if element in inside:
                    continue
                above = element.above
                is_pair = above is not None and above.tag == "contact"
                (loose if is_pair or element in self._unread else others).append(element)
        return Referring(tuple(loose), tuple(others))
