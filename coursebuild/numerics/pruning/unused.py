"""Things of a model that nothing uses: assets, classes, sites, keyframes, sensors, flags.

Entry point: `unused(look, kept)`.

References inside the model are found by the attributes that can hold one; whether that was all of
them is told by MuJoCo, which does not compile a model without a thing that something names.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from pathlib import PurePosixPath

from coursebuild.numerics.pruning.markup import Element
from coursebuild.numerics.pruning.model_text import thing_kind
from coursebuild.numerics.pruning.trials import Candidate, Item, PruningContext, named_item, worded

_SITE = frozenset(
    "site site1 site2 refsite cranksite slidersite sidesite objname refname".split(" ")
)
"""Attributes that may name a site."""

Kept = Callable[[str, str], bool]
"""Whether a finding of this kind and name is to be kept."""


def unused(look: PruningContext, kept: Kept) -> Iterator[Candidate]:
    """What nothing refers to and nobody reads."""
    assets = _Assets(look, kept)
    yield from assets.candidates()
    yield from _some("unused-default", "no element is of the {}", _classes(look), _UNNAMED, "class")
    sensors = _sensors(look)
    yield from _some("sensor-unread", "nobody reads the {}", sensors, _UNREAD, "sensor")
    gone = [i.gone[0] for i in sensors if not kept("sensor-unread", i.name)]
    sites = _sites(look, gone)
    yield from _some("unused-site", "nothing refers to the {}", sites, _UNNAMED, "site")
    yield from _keyframes(look)
    yield from _flags(look)


_UNNAMED = "nothing refers to it, and nobody mentions it"


def _some(kind: str, message: str, items: list[Item], proof: str, what: str) -> Iterator[Candidate]:
    if items:
        named = worded(items, what, _PLURALS.get(what, f"{what}s")) + " {}"
        timed = what in ("site", "sensor")
        message = message.replace("{}", named)
        if any(len(item.gone) > 1 for item in items):
            message += ", but for what is in vain itself"
        yield Candidate(kind, message, tuple(items), proof, timed=timed)


_PLURALS = {"class": "classes", "mesh": "meshes"}


class _Assets:
    """Assets, from those that elements refer to down to those that assets refer to."""

    def __init__(self, look: PruningContext, kept: Kept) -> None:
        self._look = look
        self._kept = kept
        self._gone: list[Element] = []

    def candidates(self) -> Iterator[Candidate]:
        for kind, attributes in (
            ("material", ("material",)),
            ("texture", ("texture", "material")),
            ("mesh", ("mesh",)),
            ("hfield", ("hfield",)),
            ("model", ("model",)),
        ):
            items = list(self._unused(kind, (*attributes, "objname")))
            found = f"unused-{kind}"
            self._gone += [i.gone[0] for i in items if not self._kept(found, i.name)]
            yield from _some(found, "nothing uses the {}", items, _UNNAMED, kind)

    def _unused(self, kind: str, attributes: Collection[str]) -> Iterator[Item]:
        look = self._look
        for element in look.scene.elements:
            above = element.above
            if element.tag != kind or above is None or above.tag != "asset":
                continue
            name = asset_name(element)
            if not name or element.get("type") == "skybox":
                continue
            if look.readers.named(name) or (kind != "model" and look.readers.whole(kind)):
                continue
            using = [
                one
                for one in look.scene.elements
                if one is not element and any(one.get(a) == name for a in attributes)
            ]
            if all(one in self._gone for one in using):
                yield Item(name, element, (element, *using))


def asset_name(element: Element) -> str:
    """What an asset is called: after its file, where it has no name."""
    name = element.get("name")
    file = element.get("file")
    if name or not file:
        return name or ""
    return PurePosixPath(file.replace("\\", "/")).name.rpartition(".")[0] or file


def _classes(look: PruningContext) -> list[Item]:
    """Default classes that neither they nor one below them is used."""
    used = {
        value
        for one in look.scene.elements
        for value in (one.get("childclass"), one.get("class") if one.tag != "default" else None)
        if value is not None
    }
    found: list[Item] = []
    taken: set[Element] = set()
    for element in look.scene.elements:
        if element.tag != "default" or element in taken:
            continue
        name, above = element.get("class"), element.above
        if not name or above is None or above.tag != "default":
            continue
        inside = [one for one in element.walk() if one.tag == "default"]
        names = [one.get("class") or "" for one in inside]
        if used.isdisjoint(names) and not any(look.readers.named(one) for one in names):
            taken |= set(inside)
            found.append(Item(name, element, (element,)))
    return found


def _sites(look: PruningContext, gone: Collection[Element]) -> list[Item]:
    """Sites that only elements which are gone refer to."""
    if look.readers.whole("site"):
        return []
    using: dict[str, list[Element]] = {}
    for one in look.scene.elements:
        for attribute in one.attributes:
            if attribute.name in _SITE:
                using.setdefault(attribute.value, []).append(one)
    found = []
    for one in look.scene.elements:
        name = one.get("name") or ""
        if one.tag != "site" or thing_kind(one) != "site" or look.readers.named(name):
            continue
        users = using.get(name, []) if name else []
        if all(user in gone for user in users):
            found.append(named_item(one, *users))
    return found


def _keyframes(look: PruningContext) -> Iterator[Candidate]:
    keys = [one for one in look.scene.elements if one.tag == "key" and _in_keyframe(one)]
    if look.readers.whole("keyframe") or look.readers.whole("keyframe-number"):
        return
    if len(keys) != look.model.nkey:
        return
    items = [
        named_item(one)
        for number, one in enumerate(keys)
        if number not in look.used_keyframes and not look.readers.named(one.get("name") or "")
    ]
    proof = "no scenario begins there, and nobody mentions it"
    yield from _some("unused-keyframe", "nothing begins at the {}", items, proof, "keyframe")


def _in_keyframe(element: Element) -> bool:
    return element.above is not None and element.above.tag == "keyframe"


def _sensors(look: PruningContext) -> list[Item]:
    return [named_item(one) for one in unread_sensors(look)]


_UNREAD = "what a sensor says changes nothing that moves"


def unread_sensors(look: PruningContext) -> list[Element]:
    """Sensors that nobody reads."""
    if look.readers.whole("sensor"):
        return []
    return [
        one
        for one in look.scene.elements
        if thing_kind(one) == "sensor" and not look.readers.named(one.get("name") or "")
    ]


def _flags(look: PruningContext) -> Iterator[Candidate]:
    for flag, what in (("energy", "energy"), ("fwdinv", "fwdinv")):
        having = [
            one
            for one in look.scene.elements
            if one.tag == "flag" and one.get(flag) == "enable" and one.above is not None
        ]
        if not having or look.readers.whole(what):
            continue
        said = {
            "energy": "energy is computed in every step, and nobody reads it",
            "fwdinv": "forward and inverse dynamics are compared in every step, for nobody",
        }[flag]
        item = Item(flag, having[-1], flags=((flag, None),))
        yield Candidate(f"{flag}-flag", said, (item,), "it is computed beside the motion")
