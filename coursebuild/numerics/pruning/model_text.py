"""A model as its files and as what MuJoCo makes of them.

Entry point: `open_model`; then `ModelText.compiled(edits)`, `ModelText.elements`, `ModelText.ids`.

1. Files that the model includes are found where MuJoCo finds them, and read as markup.
2. To compile a change, all files are put together to one text. That this is the same model is
   checked byte by byte on the unchanged one.
3. Which bodies, geoms, … an element became is found by names: those without one are given one, and
   the model is compiled once more. An element that is repeated became several.
"""

from __future__ import annotations

import posixpath
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any

import mujoco
import numpy as np
from msgspec import Struct

from coursebuild.numerics.pruning.edits import ModelEdit, apply_edits, set_attributes
from coursebuild.numerics.pruning.markup import Element, Markup, parse_markup, splice

_DEEPEST = 32

Read = Callable[[str], bytes | None]
"""The bytes of a file by its path from the course's root; nothing where it is not there."""
Compile = Callable[[bytes], Any]
"""A text, as if it stood where the model's file stands, to a `mjModel`; ValueError if it cannot."""


class ModelTextError(Exception):
    """A model that the diet cannot work on; the text says why."""


KINDS: Mapping[str, tuple[mujoco.mjtObj, str]] = {
    "body": (mujoco.mjtObj.mjOBJ_BODY, "nbody"),
    "joint": (mujoco.mjtObj.mjOBJ_JOINT, "njnt"),
    "geom": (mujoco.mjtObj.mjOBJ_GEOM, "ngeom"),
    "site": (mujoco.mjtObj.mjOBJ_SITE, "nsite"),
    "sensor": (mujoco.mjtObj.mjOBJ_SENSOR, "nsensor"),
    "actuator": (mujoco.mjtObj.mjOBJ_ACTUATOR, "nu"),
    "tendon": (mujoco.mjtObj.mjOBJ_TENDON, "ntendon"),
}
"""Kinds of things that elements become: MuJoCo's number for them, and where it counts them."""
_IN_BODIES = {"body": "body", "joint": "joint", "freejoint": "joint", "geom": "geom"}
_IN_BODIES |= {"site": "site"}
_HOLDERS = frozenset(("worldbody", "body", "frame", "replicate"))
_SECTIONS = frozenset(("sensor", "actuator", "tendon"))


class Thing(Struct, frozen=True):
    """What an element becomes in the compiled model."""

    kind: str
    """A key of `KINDS`."""
    ids: tuple[int, ...]


class ModelText:
    """A model and its files."""

    def __init__(self, main: Markup, compile: Compile, *, check: bool) -> None:
        self.main = main
        self.documents = tuple(_with_included(main))
        self.elements: tuple[Element, ...] = tuple(main.root.walk())
        """All of them, in the order in which MuJoCo meets them."""
        self._compile = compile
        self.model: Any = self._checked() if check else self.compiled()
        self._things = self._named()

    def compiled(self, edits: Iterable[ModelEdit] = ()) -> Any:
        """A `mjModel` of the files with these changes.

        Raises:
            ValueError: MuJoCo does not take it, or the changes contradict each other.
        """
        return self._compile(_whole(self.main, _by_path(edits)))

    def files(self, edits: Iterable[ModelEdit]) -> dict[str, bytes]:
        """The new bytes of each file that these edits change."""
        data = {document.path: document.data for document in self.documents}
        return {path: apply_edits(data[path], some) for path, some in _by_path(edits).items()}

    def ids(self, element: Element) -> Thing | None:
        """What an element becomes; `None` where that is not known."""
        return self._things.get(element)

    def things(self, kind: str) -> Iterator[tuple[Element, tuple[int, ...]]]:
        """Elements of a kind, with the numbers of what they become."""
        for element, thing in self._things.items():
            if thing.kind == kind:
                yield element, thing.ids

    def ids_of(self, elements: Iterable[Element], kind: str) -> frozenset[int]:
        """The numbers of one kind that elements become."""
        things = (self.ids(element) for element in elements)
        return frozenset(i for one in things if one and one.kind == kind for i in one.ids)

    def _checked(self) -> Any:
        model = self._compile(self.main.data)
        if self.main.included:
            try:
                same = model_bytes(self.compiled()) == model_bytes(model)
            except ValueError:
                same = False
            if not same:
                raise ModelTextError("what it includes cannot be put into one text")
        return model

    def _named(self) -> dict[Element, Thing]:
        """What each element becomes; nothing where names cannot be given."""
        wanted: dict[Element, tuple[str, str]] = {}
        edits: list[ModelEdit] = []
        for number, element in enumerate(self.elements):
            kind = thing_kind(element)
            if kind is None:
                continue
            name = element.get("name")
            if not name:
                name = f"diet_{number}_"
                while any(name.encode() in one.data for one in self.documents):
                    name += "_"
                edits += set_attributes(element, (("name", name),))
            wanted[element] = kind, name
        try:
            model = self.compiled(edits) if edits else self.model
        except ValueError:
            return {}
        if any(getattr(model, size) != getattr(self.model, size) for _, size in KINDS.values()):
            return {}
        names = {
            kind: [mujoco.mj_id2name(model, code, i) or "" for i in range(getattr(model, size))]
            for kind, (code, size) in KINDS.items()
        }
        return _assigned(wanted, names)


def open_model(path: str, read: Read, compile: Compile, *, check: bool = True) -> ModelText:
    """Read a model and what it includes.

    Args:
        path: the model's file, POSIX, from the course's root.
        read: gives the bytes of such a file.
        compile: gives the `mjModel` of a text that would stand there.
        check: whether its files are those that MuJoCo would include, so that this can be checked.

    Raises:
        MarkupError: one of the files is no XML.
        ModelTextError: it cannot be worked on.
        ValueError: MuJoCo does not compile it.
    """
    data = read(path)
    if data is None:
        raise ModelTextError(f"there is no file {path}")
    main = parse_markup(path, data)
    if main.root.tag != "mujoco":
        raise ModelTextError(f"its root is <{main.root.tag}>: it is no model of its own")
    _include(main, posixpath.dirname(path), read, 0)
    return ModelText(main, compile, check=check)


def _include(document: Markup, folder: str, read: Read, depth: int) -> None:
    """Splice in the files that a file includes, from its folder or the model's."""
    for element in list(document.root.walk()):
        if element.tag != "include":
            continue
        file = element.get("file") or ""
        here = posixpath.dirname(document.path)
        paths = [posixpath.normpath(posixpath.join(base, file)) for base in (folder, here)]
        path = next((one for one in paths if read(one) is not None), None)
        if path is None:
            raise ModelTextError(f"it includes {file}, which is not in the course")
        if depth >= _DEEPEST:
            raise ModelTextError("its includes are nested too deeply")
        inner = parse_markup(path, read(path) or b"")
        _include(inner, folder, read, depth + 1)
        splice(element, inner)


def _with_included(document: Markup) -> Iterator[Markup]:
    yield document
    for inner in document.included:
        yield from _with_included(inner)


def _by_path(edits: Iterable[ModelEdit]) -> dict[str, list[ModelEdit]]:
    found: dict[str, list[ModelEdit]] = {}
    for edit in edits:
        found.setdefault(edit.path, []).append(edit)
    return found


def _whole(document: Markup, edits: Mapping[str, Sequence[ModelEdit]]) -> bytes:
    """A file with edits, and in place of its includes what these hold."""
    own = list(edits.get(document.path, ()))
    for inner in document.included:
        include = inner.at
        assert include is not None
        root = parse_markup(inner.path, text := _whole(inner, edits)).root
        held = text[root.head : root.tail]
        own.append(ModelEdit(document.path, include.start, include.end, held))
    return apply_edits(document.data, own)


def model_bytes(model: Any) -> bytes:
    """A compiled model as bytes."""
    buffer = np.zeros(mujoco.mj_sizeModel(model), np.uint8)
    mujoco.mj_saveModel(model, None, buffer)
    return buffer.tobytes()


def section_of(element: Element) -> str:
    """The section that an element stands in; empty for one that stands elsewhere."""
    parent = element.parent
    return parent.tag if parent and parent.parent and not parent.parent.parent else ""


def thing_kind(element: Element) -> str | None:
    """What kind of thing an element becomes; `None` for others, and for templates of things."""
    section = section_of(element)
    if section in _SECTIONS:
        return section
    held = element.parent is not None and element.parent.tag in _HOLDERS
    return _IN_BODIES.get(element.tag) if held else None


def _assigned(
    wanted: Mapping[Element, tuple[str, str]], names: Mapping[str, Sequence[str]]
) -> dict[Element, Thing]:
    """Elements by the names of what they became; nothing for those whose names two may mean."""
    found: dict[Element, Thing] = {}
    taken: dict[tuple[str, int], list[Element]] = {}
    places = {kind: {name: i for i, name in enumerate(all)} for kind, all in names.items()}
    for element, (kind, name) in wanted.items():
        ids: tuple[int, ...]
        if any(one.tag == "replicate" for one in element.above()):
            shape = re.compile(re.escape(name) + r".*\d", re.DOTALL)
            ids = tuple(i for i, one in enumerate(names[kind]) if shape.fullmatch(one))
        else:
            ids = (places[kind][name],) if name in places[kind] else ()
        if ids:
            found[element] = Thing(kind, ids)
            for number in ids:
                taken.setdefault((kind, number), []).append(element)
    for elements in taken.values():
        if len(elements) > 1:
            for element in elements:
                found.pop(element, None)
    return found
