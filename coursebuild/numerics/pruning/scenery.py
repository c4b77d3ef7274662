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
4. A geom that is fixed to the world is seen, so it is far only by five times that size. That it
   cannot be reached is a bound, if there is one for all that moves.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from coursebuild.numerics.pruning.markup import Element, place_of
from coursebuild.numerics.pruning.reachability import moving_ball
from coursebuild.numerics.pruning.trees import Bounds, References, Trees, Vector
from coursebuild.numerics.pruning.trials import Candidate, Item, PruningContext, named_item, worded

REGIONS = 5.0
"""Sizes of the region that what matters sweeps, or can reach."""
CLEAR = 0.1
"""Of the radius of all that what matters can reach: how far out of it a body is at least."""
MOVES = 10.0
"""Ways that a body goes itself."""
_VIEWS = frozenset(("camera", "light"))
"""What shows other things, wherever it is."""


def scenery(look: PruningContext) -> Iterator[Candidate]:
    """Geoms fixed to the world, and bodies that move, far from everything else."""
    trees = Trees(look, References(look))
    focus = trees.focus()
    if not focus or not look.seen:
        return
    region = trees.region(focus)
    yield from _bodies(look, trees, focus, region)
    yield from _geoms(look, trees, focus, region)


def _bodies(
    look: PruningContext, trees: Trees, focus: frozenset[int], region: Bounds
) -> Iterator[Candidate]:
    far = _out_of_reach(trees, focus, region)
    items: list[Item] = []
    roots: set[int] = set()
    for element in look.scene.elements:
        thing = look.scene.ids(element)
        if thing is None or thing.kind != "body" or any(b.tag in _VIEWS for b in element.walk()):
            continue
        if far.issuperset(thing.ids):
            roots |= set(thing.ids)
            items.append(named_item(element, *trees.references.of([element]).loose))
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
            split=False,
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
    size = -1
    while size != len(far):
        size = len(far)
        for a, b in trees.touching:
            pair = {trees.of_geom[a], trees.of_geom[b]} - {-1}
            if not pair <= far:
                far -= pair
    return frozenset(far)


def _geoms(
    look: PruningContext, trees: Trees, focus: frozenset[int], region: Bounds
) -> Iterator[Candidate]:
    model = look.model
    moving = [g for g in range(model.ngeom) if trees.of_body[int(model.geom_bodyid[g])] in focus]
    ball = moving_ball(model, moving) if focus == trees.roots else None
    items: list[Item] = []
    done: set[Element] = set()
    for element in look.scene.elements:
        if element in done or not _is_scenery(look, trees, element, region, ball):
            continue
        refers = trees.references.of([element])
        if not refers.others:
            done |= set(element.walk())
            items.append(Item(_name(element), element, (element, *refers.loose)))
    if items and not look.readers.whole("shape"):
        message = worded(items, "the geom {}", "the geoms {}")
        message += " of the world can be reached by nothing, and "
        message += worded(items, "lies far away", "lie far away")
        proof = "" if ball is None else "whatever the joints do, all that moves stays away from it"
        who = look.readers.whole("body-number")
        doubt = f"{who} may count geoms by number" if who else ""
        yield Candidate("far-geom", message, tuple(items), proof, doubt=doubt)


def _is_scenery(
    look: PruningContext,
    trees: Trees,
    element: Element,
    region: Bounds,
    ball: tuple[Vector, float] | None,
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


def _is_far(trees: Trees, geom: int, region: Bounds, ball: tuple[Vector, float] | None) -> bool:
    model = trees.model
    body = int(model.geom_bodyid[geom])
    size = float(model.geom_rbound[geom])
    if trees.of_body[body] >= 0 or size <= 0:  # it moves, or is a plane
        return False
    if geom in trees.touched:
        return False
    place = trees.place[geom]
    near = Bounds(place - size, place + size)
    if region.distance(near) < REGIONS * region.size:
        return False
    return ball is None or float(np.linalg.norm(place - ball[0])) > ball[1] + size
