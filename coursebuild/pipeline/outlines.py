"""What is known of a document without its text, kept from build to build.

Entry points: `Task`, a text; `Outline`.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable

from msgspec import Struct

from coursebuild.diagnostics import Diagnostic
from coursebuild.effects.tool import tool_digest
from coursebuild.model import Document
from coursebuild.source import Source


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


def all_imports(outlines: Iterable[Outline]) -> dict[str, frozenset[str]]:
    """Modules by the path of the script that imports them."""
    return {path: frozenset(modules) for outline in outlines for path, modules in outline.imports}
