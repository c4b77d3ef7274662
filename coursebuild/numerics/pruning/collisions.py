"""Contacts that are searched for in vain.

Entry point: `collisions(look)`.

Where a bound says that no two geoms can touch, contact can be off. Where it says so of single geoms
these need not take part. Where there is no such bound and nothing touched in the runs, that is said
too, as the weaker thing that it is.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice

from coursebuild.numerics.pruning.candidates import Candidate, Item, Look
from coursebuild.numerics.pruning.edits import set_attributes
from coursebuild.numerics.pruning.markup import place_of
from coursebuild.numerics.pruning.reachability import Pair, each_pair, separate

_OFF = (("contact", "disable"),)
MOST_PAIRS = 100_000
"""Pairs beyond which nothing is proved of them."""


def collisions(look: Look) -> Iterator[Candidate]:
    """Contact as a whole, or geoms that can touch nothing."""
    model = look.model
    pairs = frozenset(islice(each_pair(model), MOST_PAIRS))
    if model.nflex or not pairs:
        return
    apart = separate(model, pairs) if len(pairs) < MOST_PAIRS else frozenset()
    changed = look.readers.whole("shape")
    proof = "" if changed else f"none of {_pairs(pairs)} can meet, whatever the joints do"
    item = Item("contact", None, flags=_OFF)
    if apart == pairs:
        message = "contacts are searched for, and nothing can touch"
        yield Candidate("contact-off", message, (item,), proof)
        return
    if look.seen and not any(seen.touching for seen in look.seen):
        message = "contacts are searched for, and nothing touched"
        yield Candidate("contact-off", message, (item,))
    if not changed:
        yield from _geoms(look, pairs, apart)


def _pairs(pairs: frozenset[Pair]) -> str:
    return f"{len(pairs)} pairs of geoms" if len(pairs) != 1 else "1 pair of geoms"


def _geoms(look: Look, pairs: frozenset[Pair], apart: frozenset[Pair]) -> Iterator[Candidate]:
    near = {geom for pair in pairs - apart for geom in pair}
    far = {geom for pair in apart for geom in pair} - near
    explicit = {int(g) for g in (*look.model.pair_geom1, *look.model.pair_geom2)}
    items = []
    for element in look.scene.elements:
        thing = look.scene.ids(element)
        if element.tag != "geom" or thing is None or not far.issuperset(thing.ids):
            continue
        if explicit.isdisjoint(thing.ids):
            edits = set_attributes(element, (("contype", "0"), ("conaffinity", "0")))
            name = element.get("name") or place_of(element)
            items.append(Item(name, element, edits=edits))
    if items:
        what = "the geom {}" if len(items) == 1 else "the geoms {}"
        yield Candidate(
            "collision-unreachable",
            f"contacts are searched for on {what}, which can touch nothing",
            tuple(items),
            "whatever the joints do, every geom that they could collide with is out of reach",
        )
