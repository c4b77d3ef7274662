"""A model as its files and as what MuJoCo compiles from them.

1. Files that the model includes are found where MuJoCo finds them, and read as markup.
2. A change is compiled from the bytes that the files would have.
3. The bodies, geoms, … of an element are found by name: elements without a name get one, and the
   model is compiled once more. An element that is repeated becomes several things.
"""

from __future__ import annotations

import posixpath
import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any

import mujoco
import numpy as np

from mjbench.pruning.xml_edits import (
    Element,
    Markup,
    ModelEdit,
    apply_edits,
    merge_edits,
    parse_markup,
    set_attributes,
    splice,
)
from mjbench.reports.diet_report import TextEdit

_DEEPEST = 32

Read = Callable[[str], bytes | None]
"""A path from the course's root → the bytes of the file; `None` where there is none."""
Compile = Callable[[Mapping[str, bytes]], Any]
"""The bytes of files, by path → the `mjModel`; ValueError if it does not compile."""


class ModelTextError(Exception):
    """The diet cannot work on a model; the message says why."""


KINDS: Mapping[str, tuple[mujoco.mjtObj, str]] = {
    "body": (mujoco.mjtObj.mjOBJ_BODY, "nbody"),
    "joint": (mujoco.mjtObj.mjOBJ_JOINT, "njnt"),
    "geom": (mujoco.mjtObj.mjOBJ_GEOM, "ngeom"),
    "site": (mujoco.mjtObj.mjOBJ_SITE, "nsite"),
    "camera": (mujoco.mjtObj.mjOBJ_CAMERA, "ncam"),
    "sensor": (mujoco.mjtObj.mjOBJ_SENSOR, "nsensor"),
    "actuator": (mujoco.mjtObj.mjOBJ_ACTUATOR, "nactuator"),
    "tendon": (mujoco.mjtObj.mjOBJ_TENDON, "ntendon"),
    "equality": (mujoco.mjtObj.mjOBJ_EQUALITY, "neq"),
}
"""Kinds of things that elements become: MuJoCo's type, and the field with their number."""
_IN_BODIES = {kind: kind for kind in ("body", "joint", "geom", "site", "camera")}
_IN_BODIES |= {"freejoint": "joint"}
_HOLDERS = frozenset(("worldbody", "body", "frame", "replicate"))
_SECTIONS = frozenset(("sensor", "actuator", "tendon", "equality"))


class ModelText:
    """A model and its files."""

    def __init__(self, main: Markup, compile: Compile) -> None:
        self.main = main
        self.documents = tuple(_with_included(main))
        self.elements: tuple[Element, ...] = tuple(main.root.walk())
        """All of them, in the order in which MuJoCo meets them."""
        self._compile = compile
        self.model: Any = self.compile()
        self._ids = self._find_ids()

    def compile(self, edits: Iterable[ModelEdit] = ()) -> Any:
        """A `mjModel` of the files with these changes.

        Raises:
            ValueError: MuJoCo does not take it, or the changes contradict each other.
        """
        files = {document.path: document.data for document in self.documents}
        return self._compile(files | self.files(edits))

    def files(self, edits: Iterable[ModelEdit]) -> dict[str, bytes]:
        """The new bytes of each file that these edits change."""
        data = {document.path: document.data for document in self.documents}
        edits_by_path: dict[str, list[ModelEdit]] = {}
        for edit in edits:
            edits_by_path.setdefault(edit.path, []).append(edit)
        return {path: apply_edits(data[path], part) for path, part in edits_by_path.items()}

    def describe(self, edits: Iterable[ModelEdit]) -> tuple[TextEdit, ...]:
        """These changes with their places and what stood there."""
        documents, text_edits = {document.path: document for document in self.documents}, []
        for edit in merge_edits(edits):
            document = documents[edit.path]
            line, column = document.position(edit.start)
            old = document.data[edit.start : edit.end].decode("utf-8", "replace")
            new = edit.new.decode("utf-8", "replace")
            text_edits.append(TextEdit(edit.path, line, column, old, new))
        return tuple(text_edits)

    def ids(self, element: Element) -> tuple[int, ...]:
        """The numbers of the things that an element becomes; empty where that is not known."""
        return self._ids.get(element, ())

    def things(self, kind: str) -> Iterator[tuple[Element, tuple[int, ...]]]:
        """The elements of a kind, with the numbers of the things that they become."""
        for element, ids in self._ids.items():
            if thing_kind(element) == kind:
                yield element, ids

    def ids_of(self, elements: Iterable[Element], kind: str) -> frozenset[int]:
        """The numbers of the things of one kind that elements become."""
        return frozenset(i for e in elements if thing_kind(e) == kind for i in self.ids(e))

    def _find_ids(self) -> dict[Element, tuple[int, ...]]:
        """The things that each element becomes; empty where names cannot be given."""
        names: dict[Element, str] = {}
        edits: list[ModelEdit] = []
        for number, element in enumerate(self.elements):
            if thing_kind(element) is None:
                continue
            name = element.get("name")
            if not name:
                name = f"diet_{number}_"
                while any(name.encode() in document.data for document in self.documents):
                    name += "_"
                edits += set_attributes(element, (("name", name),))
            names[element] = name
        try:
            model = self.compile(edits) if edits else self.model
        except ValueError:
            return {}
        if any(getattr(model, size) != getattr(self.model, size) for _, size in KINDS.values()):
            return {}
        known_names = {
            kind: [mujoco.mj_id2name(model, code, i) or "" for i in range(getattr(model, size))]
            for kind, (code, size) in KINDS.items()
        }
        ids: dict[Element, tuple[int, ...]] = {}
        for element, name in names.items():
            candidates = known_names[thing_kind(element) or ""]
            if any(node.tag == "replicate" for node in element.ancestors()):
                shape = re.compile(re.escape(name) + r".*\d", re.DOTALL)
                matches = (i for i, text in enumerate(candidates) if shape.fullmatch(text))
                ids[element] = tuple(matches)
            else:
                ids[element] = (candidates.index(name),) if name in candidates else ()
        # Elements that may mean the same thing get none.
        owners = Counter((thing_kind(e), i) for e, numbers in ids.items() for i in numbers)
        return {
            e: numbers
            for e, numbers in ids.items()
            if numbers and all(owners[thing_kind(e), i] == 1 for i in numbers)
        }


def open_model(path: str, read: Read, compile: Compile) -> ModelText:
    """Read a model and what it includes.

    Args:
        path: the model's file, POSIX, from the course's root.
        read: gives the bytes of such a file.
        compile: gives the `mjModel` of files with other bytes.

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
        raise ModelTextError(f"its root is <{main.root.tag}>: it is not a whole model")
    _splice_includes(main, posixpath.dirname(path), read, 0)
    return ModelText(main, compile)


def _splice_includes(document: Markup, folder: str, read: Read, depth: int) -> None:
    """Splice in the files that a file includes, from its folder or the model's."""
    for element in list(document.root.walk()):
        if element.tag != "include":
            continue
        file = element.get("file") or ""
        own_folder = posixpath.dirname(document.path)
        paths = [posixpath.normpath(posixpath.join(base, file)) for base in (folder, own_folder)]
        path = next((candidate for candidate in paths if read(candidate) is not None), None)
        if path is None:
            raise ModelTextError(f"it includes {file}, which is not in the course")
        if depth >= _DEEPEST:
            raise ModelTextError("its includes are nested too deeply")
        inner = parse_markup(path, read(path) or b"")
        _splice_includes(inner, folder, read, depth + 1)
        splice(element, inner)


def _with_included(document: Markup) -> Iterator[Markup]:
    yield document
    for inner in document.included:
        yield from _with_included(inner)


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
    """The kind of thing that an element becomes; `None` for others, and for templates of things."""
    section = section_of(element)
    if section in _SECTIONS:
        return section
    is_in_holder = element.parent is not None and element.parent.tag in _HOLDERS
    return _IN_BODIES.get(element.tag) if is_in_holder else None
