"""What is known of a document without its text, kept from build to build.

Entry points: `Task`, a text; `Outline`; `packed` and `unpacked`, an outline as bytes; `pack` and
`unpack`, any value whose places are in one source.

An outline as bytes holds no text of the document but that of its scripts and the like: it is put
together with the source again, which whoever unpacks it has read anyway.
"""

from __future__ import annotations

import copyreg
import hashlib
import io
import pickle
import struct
from collections.abc import Iterable
from typing import Any

from msgspec import Struct

from coursebuild.diagnostics import Diagnostic
from coursebuild.effects.tool import tool_digest
from coursebuild.model import Document
from coursebuild.source import Source

_LENGTH = struct.Struct("<I")


class Task(Struct, frozen=True):
    """A text to parse."""

    source: Source
    callouts: frozenset[str]
    lesson: bool
    key: str
    """A hash of all that its outline depends on."""

    @classmethod
    def of(cls, source: Source, callouts: frozenset[str], lesson: bool) -> Task:
        """With its key."""
        parts = (tool_digest(), str(lesson), *sorted(callouts), "", source.path)
        digest = hashlib.sha256("\0".join(parts).encode("utf-8", "surrogatepass"))
        digest.update(b"\0" + source.digest)
        return cls(source, callouts, lesson, digest.hexdigest())

    def is_of(self, source: Source, callouts: frozenset[str], lesson: bool) -> bool:
        """Whether it is the task of these."""
        same = self.callouts == callouts and self.lesson == lesson
        return same and (self.source is source or self.source == source)


class Outline(Struct, frozen=True):
    """A parsed text: what others than its own page look at, and what is wrong in it."""

    skeleton: Document
    diagnostics: tuple[Diagnostic, ...]
    """Those of formulas among them."""
    imports: tuple[tuple[str, tuple[str, ...]], ...]
    """Paths of scripts, each with the modules that it imports."""
    lasting: bool
    """Whether the same text gives the same again."""
    face: str = ""
    """What others than its own page can see of it, as a hash; see `pipeline.faces`."""


def _source() -> Source:
    """The name in packed values of the source that they are of; who unpacks them puts it in."""
    raise TypeError("a packed value is unpacked with its source")


_LEFT_OUT = {**copyreg.dispatch_table, Source: lambda source: (_source, ())}


class _Packer(pickle.Pickler):
    """Leaves out the source."""

    dispatch_table = _LEFT_OUT


_MEANT: dict[tuple[str, str], Any] = {}
"""What names mean: to find out takes longer than to make a value of the class."""


class _Unpacker(pickle.Unpickler):
    """Puts the source in."""

    def __init__(self, data: bytes, source: Source) -> None:
        super().__init__(io.BytesIO(data))
        self.source = source

    def find_class(self, module: str, name: str) -> Any:
        """What a name means; there is only one source."""
        found = _MEANT.get((module, name))
        if found is not None:
            return found
        if name == _source.__name__ and module == __name__:
            source = self.source  # not through `self`, which holds all that it has unpacked
            return lambda: source
        meant = _MEANT[module, name] = super().find_class(module, name)
        return meant


def pack(value: object) -> bytes:
    """A value as bytes, without the one source that all its places are in."""
    out = io.BytesIO()
    _Packer(out, pickle.HIGHEST_PROTOCOL).dump(value)
    return out.getvalue()


def unpack(data: bytes, source: Source) -> Any:
    """The value that `pack` was given; `None` where the bytes are none."""
    try:
        return _Unpacker(data, source).load()
    except Exception:  # whatever damaged bytes make of it
        return None


def packed(outline: Outline) -> bytes:
    """An outline as bytes."""
    return pack(outline)


def unpacked(data: bytes, source: Source) -> Outline | None:
    """The outline of a source; `None` where the bytes are none."""
    found = unpack(data, source)
    return found if isinstance(found, Outline) else None


def all_imports(outlines: Iterable[Outline]) -> dict[str, frozenset[str]]:
    """Modules by the path of the script that imports them."""
    return {path: frozenset(modules) for outline in outlines for path, modules in outline.imports}
