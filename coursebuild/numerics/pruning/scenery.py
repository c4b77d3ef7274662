"""What lies so far away that it has no part in what the scene is about.

Entry point: `scenery(look)`.

1. A scene is about the bodies that are driven, measured, coupled, set in motion or named by a
   lesson. Where there is none of these, it is about those with a sensor, though nobody reads it;
   else about mechanisms rather than single free bodies; else about those that have a name. Where
   all are alike, nothing is known to be beside the point.
2. What they can touch, by contact in a run, belongs to them, and so on.
3. A single free body without a name is far when it stays clear of all that they can reach, by ten
   times the way that it goes itself. Another body that moves must also be away by five times the
   size of what they reach; where there is no bound on that, all must be, by what they sweep.
   This holds in these runs only.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import mujoco
import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from coursebuild.numerics.pruning.markup import Element
from coursebuild.numerics.pruning.model_text import is_repeated
from coursebuild.numerics.pruning.reachability import moving_ball
from coursebuild.numerics.pruning.trials import Candidate, Item, PruningContext, named_item, worded
from coursebuild.numerics.pruning.unused import unread_sensors

Vector = NDArray[np.float64]

REGIONS = 5.0
"""Sizes of the region that what matters sweeps, or can reach."""
CLEAR = 0.1
"""Of the radius of all that what matters can reach: how far out of it a body is at least."""
MOVES = 10.0
"""Ways that a body goes itself."""
_VIEWS = frozenset(("camera", "light"))
"""What shows other things, wherever it is."""
_NOT_REFERENCES = frozenset(("name", "class", "childclass", "material", "mesh", "file", "type"))


def scenery(look: PruningContext) -> Iterator[Candidate]:
    """Bodies that move, far from everything else."""
    trees = Trees(look)
    focus = trees.focus()
    if not focus or not look.seen:
        return
    region = trees.region(focus)
    far = _out_of_reach(trees, focus, region)
    items: list[Item] = []
    roots: set[int] = set()
    for element, ids in look.things("body"):
        if far.issuperset(ids) and not any(one.tag in _VIEWS for one in element.walk()):
            roots |= set(ids)
            items.append(named_item(element, *trees.references([element])[0]))
    if items:
        nearest = min(region.distance(trees.region([root])) for root in roots)
        farthest = max(trees.way(root) for root in roots)
        message = worded(items, "the body {} stays", "the bodies {} stay")
        message += f" at least {nearest:.3g} m away from what the scene is about, and "
        message += worded(items, "moves", "move") + f" {farthest:.2g} m"
        who = look.readers.whole("number") or look.readers.whole("body-number")
        blocked = ""
        if look.numbered & {"qpos", "qvel"}:
            blocked = "scenarios give positions by number: these would have to be shortened"
        yield Candidate(
            "far-body",
            message,
            tuple(items),
            _FAR,
            by_runs=True,
            blocked=blocked,
            doubt=f"{who} may count coordinates or bodies by number" if who else "",
        )


_FAR = "nothing that could touch it comes near in these runs"


def _out_of_reach(trees: Trees, focus: frozenset[int], region: Bounds) -> frozenset[int]:
    """Trees that what the scene is about can never get to, and that do not come to it in a run.

    What touches one that may be reached has a part in it.
    """
    model = trees.model
    ball = moving_ball(model, [g for g in range(model.ngeom) if trees.of_geom[g] in focus])
    far: set[int] = set()
    for root in trees.roots - focus:
        own = trees.region([root])
        away, least = region.distance(own), REGIONS * region.size
        if ball is not None:
            away = own.distance(Bounds(ball[0], ball[0])) - ball[1]
            least = CLEAR * ball[1] if trees.is_rubble(root) else max(least, REGIONS * 2 * ball[1])
        if away > max(least, MOVES * trees.way(root)):
            far.add(root)
    return frozenset(trees.roots - trees.touched_by(trees.roots - far))


# ------------------------------------------------------------------------ bodies that move together


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

    def __init__(self, look: PruningContext) -> None:
        self.look = look
        self._unread = set(unread_sensors(look))
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
        self._elements: dict[int, list[Element]] = {root: [] for root in self.roots}
        for kind, bodies in (
            ("body", range(model.nbody)),
            ("joint", model.jnt_bodyid),
            ("geom", model.geom_bodyid),
            ("site", model.site_bodyid),
        ):
            for element, ids in look.things(kind):
                for root in {self.of_body[int(bodies[i])] for i in ids} - {-1}:
                    self._elements[root].append(element)

    def focus(self) -> frozenset[int]:
        """The trees that the scene is about, and what touches them."""
        if self.model.nflex:
            return self.roots
        found = {root for root in self.roots if self._matters(root)} | self._thrown()
        for likely in (self._sensed, self._jointed, self._named):
            if not found:
                found = {root for root in self.roots if likely(root)}
        return self.touched_by(found)

    def touched_by(self, roots: Iterable[int]) -> frozenset[int]:
        """These trees, what touches them in a run, what touches that, and so on."""
        found = set(roots)
        pairs = [{self.of_geom[a], self.of_geom[b]} - {-1} for a, b in self.touching]
        while more := {root for pair in pairs if pair & found for root in pair - found}:
            found |= more
        return frozenset(found)

    def _thrown(self) -> set[int]:
        """Those that a scenario sets in motion."""
        found: set[int] = set()
        for case in (seen.scene.scenario for seen in self.look.seen):
            velocity = np.array(case.qvel)
            if not case.qvel and case.keyframe >= 0:
                velocity = self.model.key_qvel[case.keyframe]
            found |= set(self.of_dof[np.nonzero(velocity)[0]].tolist())
        return found

    def is_rubble(self, root: int) -> bool:
        """Whether it is one free body to which nobody gave a name."""
        return not (self._jointed(root) or self._named(root))

    def _sensed(self, root: int) -> bool:
        return bool(self.references(self._elements[root])[0])

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
        return bool(self.references(elements)[1])

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

    def references(self, elements: Iterable[Element]) -> tuple[list[Element], list[Element]]:
        """What refers to elements by their names, from outside of them.

        First what would go with them (unread sensors, excluded and explicit pairs), then what needs
        them.
        """
        below = {one: None for element in elements for one in element.walk()}
        found = [one for element in below for one in self._naming(element) if one not in below]
        loose = [one for one in found if one in self._unread or _is_pair(one)]
        return loose, [one for one in found if one not in loose]

    def _naming(self, element: Element) -> list[Element]:
        name, values = element.get("name"), self.look.values
        if not name:
            return []
        names = [name]
        if is_repeated(element):
            names += [key for key in values if key.startswith(name) and key[-1].isdigit()]
        named = (pair for key in names for pair in values.get(key, ()))
        return [one for attribute, one in named if attribute not in _NOT_REFERENCES]


def _is_pair(element: Element) -> bool:
    return element.above is not None and element.above.tag == "contact"
