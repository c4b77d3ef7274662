"""What lies so far away that it has no part in what the scene is about.

Entry point: `scenery(look)`.

1. A scene is about the bodies that are driven, measured, coupled, set in motion or named by a
   lesson. Where there is none of these, it is about those with a sensor, though nobody reads it;
   else about mechanisms rather than single free bodies; else about those that have a name. Where
   all are alike, nothing is known to be beside the point.
2. What they can touch, by contact in a run, belongs to them, and so on.
3. A body that moves is far when it stays clear of all that they can reach, by ten times the way
   that it goes itself; where there is no bound on that, by twice the size of the region that they
   sweep. This holds in these runs only.
4. A geom that is fixed to the world is seen, so it is far only by twice that size. That it cannot
   be reached is a bound, if there is one for all that moves.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import mujoco
import numpy as np
from numpy.typing import NDArray

from coursebuild.physics.diet.candidates import Candidate, Item, Look, named_item
from coursebuild.physics.diet.markup import Element, place_of
from coursebuild.physics.diet.model_text import is_repeated
from coursebuild.physics.diet.reach import moving_ball
from coursebuild.physics.diet.unused import unread_sensors
from coursebuild.values import dataclass

Vector = NDArray[np.float64]

REGIONS = 2.0
"""Sizes of the region that what matters sweeps."""
CLEAR = 0.1
"""Of the radius of all that what matters can reach: how far out of it a body is at least."""
MOVES = 10.0
"""Ways that a body goes itself."""
_NOT_REFERENCES = frozenset(("name", "class", "childclass", "material", "mesh", "file", "type"))


def scenery(look: Look) -> Iterator[Candidate]:
    """Geoms fixed to the world, and bodies that move, far from everything else."""
    trees = _Trees(look, References(look))
    focus = trees.focus()
    if not focus or not look.seen:
        return
    region = trees.region(focus)
    yield from _bodies(look, trees, focus, region)
    yield from _geoms(look, trees, focus, region)


@dataclass(frozen=True, slots=True, eq=False)
class _Box:
    """A region, along the axes of the world."""

    low: Vector
    high: Vector

    @property
    def size(self) -> float:
        """Its diagonal, m."""
        return float(np.linalg.norm(self.high - self.low))

    def distance(self, other: _Box) -> float:
        """Between the nearest points of two, m."""
        gap = np.maximum(0.0, np.maximum(self.low - other.high, other.low - self.high))
        return float(np.linalg.norm(gap))


class _Trees:
    """Bodies that move together: each by the body at its root."""

    def __init__(self, look: Look, references: References) -> None:
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
        for case in (seen.case for seen in self.look.seen):
            velocity = np.array(case.qvel)
            if not case.qvel and case.keyframe is not None:
                velocity = self.model.key_qvel[case.keyframe]
            found |= set(self.of_dof[np.nonzero(velocity)[0]].tolist())
        return found

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

    def region(self, roots: Iterable[int]) -> _Box:
        """What trees sweep in all the runs."""
        bodies = [b for root in roots for b in self.bodies[root]]
        sizes = np.array([self._size(b) for b in bodies])[:, None]
        low = np.min([s.low[bodies] - sizes for s in self.look.seen], axis=(0, 1))
        high = np.max([s.high[bodies] + sizes for s in self.look.seen], axis=(0, 1))
        return _Box(low, high)

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


@dataclass(frozen=True, slots=True, eq=False)
class _Referring:
    """What refers to some elements."""

    loose: tuple[Element, ...]
    """What would go with them: unread sensors, excluded and explicit pairs."""
    others: tuple[Element, ...]
    """What needs them."""


class References:
    """Which elements refer to which names."""

    def __init__(self, look: Look) -> None:
        self._unread = {id(one) for one in unread_sensors(look)}
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

    def of(self, elements: Iterable[Element]) -> _Referring:
        """What refers to elements by their names, from outside of them."""
        below = [one for element in elements for one in element.walk()]
        inside = {id(one) for one in below}
        loose: list[Element] = []
        others: list[Element] = []
        for one in below:
            for element in self._naming(one):
                if id(element) in inside:
                    continue
                above = element.above
                is_pair = above is not None and above.tag == "contact"
                (loose if is_pair or id(element) in self._unread else others).append(element)
        return _Referring(tuple(loose), tuple(others))


def _bodies(look: Look, trees: _Trees, focus: frozenset[int], region: _Box) -> Iterator[Candidate]:
    far = _out_of_reach(trees, focus, region)
    items: list[Item] = []
    roots: set[int] = set()
    for element in look.scene.elements:
        thing = look.scene.ids(element)
        if thing is not None and thing.kind == "body" and far.issuperset(thing.ids):
            roots |= set(thing.ids)
            items.append(named_item(element, *trees.references.of([element]).loose))
    if items:
        nearest = min(region.distance(trees.region([root])) for root in roots)
        farthest = max(trees.way(root) for root in roots)
        one = len(items) == 1
        message = f"the {'body' if one else 'bodies'} {{}} {'stays' if one else 'stay'} at least "
        message += f"{nearest:.3g} m away from what the scene is about, out of its reach, and "
        message += f"{'moves' if one else 'move'} {farthest:.2g} m"
        blocked = _numbered(look)
        yield Candidate("far-body", message, tuple(items), _FAR, split=False, blocked=blocked)


_FAR = "nothing that could touch it comes near in these runs"


def _out_of_reach(trees: _Trees, focus: frozenset[int], region: _Box) -> frozenset[int]:
    """Trees that what the scene is about can never get to, and that do not come to it in a run.

    What touches one that may be reached has a part in it.
    """
    model = trees.model
    ball = moving_ball(model, [g for g in range(model.ngeom) if trees.of_geom[g] in focus])
    far: set[int] = set()
    for root in trees.roots - focus:
        own = trees.region([root])
        if ball is None:
            away, least = region.distance(own), REGIONS * region.size
        else:
            away, least = own.distance(_Box(ball[0], ball[0])) - ball[1], CLEAR * ball[1]
        if away > max(least, MOVES * trees.way(root)):
            far.add(root)
    size = -1
    while size != len(far):
        size = len(far)
        for a, b in trees.touching:
            pair = {trees.of_geom[a], trees.of_geom[b]} - {-1}
            if not pair <= far:
                far -= pair
    return frozenset(far)


def _numbered(look: Look) -> str:
    """Who would count wrong if a body were gone."""
    if look.numbered & {"qpos", "qvel"}:
        return "scenarios give positions by number: these would have to be shortened"
    who = look.readers.whole("number") or look.readers.whole("body-number")
    return f"{who} may count coordinates or bodies by number" if who else ""


def _geoms(look: Look, trees: _Trees, focus: frozenset[int], region: _Box) -> Iterator[Candidate]:
    model = look.model
    moving = [g for g in range(model.ngeom) if trees.of_body[int(model.geom_bodyid[g])] in focus]
    ball = moving_ball(model, moving) if focus == trees.roots else None
    items: list[Item] = []
    done: set[int] = set()
    for element in look.scene.elements:
        if id(element) in done or not _is_scenery(look, trees, element, region, ball):
            continue
        refers = trees.references.of([element])
        if not refers.others:
            done |= {id(below) for below in element.walk()}
            items.append(Item(_name(element), element, (element, *refers.loose)))
    if items and not look.readers.whole("shape"):
        what = "the geom {}" if len(items) == 1 else "the geoms {}"
        message = f"{what} of the world can be reached by nothing, and lie far away"
        if len(items) == 1:
            message = f"{what} of the world can be reached by nothing, and lies far away"
        proof = "" if ball is None else "whatever the joints do, all that moves stays away from it"
        who = look.readers.whole("body-number")
        blocked = f"{who} may count geoms by number" if who else ""
        yield Candidate("far-geom", message, tuple(items), proof, blocked=blocked)


def _is_scenery(
    look: Look, trees: _Trees, element: Element, region: _Box, ball: tuple[Vector, float] | None
) -> bool:
    """Whether it is a far geom of the world, or a body of the world with nothing but such geoms."""
    if element.tag not in ("geom", "body"):
        return False
    geoms: set[int] = set()
    for one in element.walk():
        thing = look.scene.ids(one)
        if one.tag not in ("geom", "body", "inertial", "frame", "replicate") or (
            one.tag in ("geom", "body") and thing is None
        ):
            return False
        if look.readers.named(one.get("name") or ""):
            return False
        if thing is not None and thing.kind == "body":
            if any(trees.of_body[number] >= 0 for number in thing.ids):
                return False
        elif thing is not None:
            geoms |= set(thing.ids)
    return bool(geoms) and all(_is_far(trees, geom, region, ball) for geom in geoms)


def _name(element: Element) -> str:
    return element.get("name") or place_of(element)


def _is_far(trees: _Trees, geom: int, region: _Box, ball: tuple[Vector, float] | None) -> bool:
    model = trees.model
    body = int(model.geom_bodyid[geom])
    size = float(model.geom_rbound[geom])
    if trees.of_body[body] >= 0 or size <= 0:  # it moves, or is a plane
        return False
    if geom in trees.touched:
        return False
    place = trees.place[geom]
    near = _Box(place - size, place + size)
    if region.distance(near) < REGIONS * region.size:
        return False
    return ball is None or float(np.linalg.norm(place - ball[0])) > ball[1] + size
