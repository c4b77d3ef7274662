"""What is fuzzed: for each target its first inputs, and what is done with one."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

from fuzz import foreign, kept, texts
from support.random_lessons import PIECES


class Target(NamedTuple):
    """What is fuzzed."""

    seeds: Callable[[], Iterator[bytes]]
    attempt: Callable[[bytes], object]
    """Raises where something is wrong."""
    repeatable: bool = True
    """Whether an input that is repeated is one too, so that the growth of time can be measured."""


def _text(attempt: Callable[[str], None]) -> Callable[[bytes], None]:
    return lambda data: attempt(data.decode("utf-8", "surrogateescape"))


TARGETS = {
    "lesson": Target(texts.lessons, _text(texts.lesson)),
    "info": Target(texts.info_strings, _text(texts.info_string)),
    "json": Target(texts.json_bodies, _text(texts.lesson)),
    "map": Target(texts.course_maps, _text(texts.course_map)),
    "declarations": Target(texts.declaration_files, _text(texts.declarations)),
    "comparison": Target(texts.outputs, _text(texts.comparison), repeatable=False),
    "figure": Target(foreign.figures, foreign.figure, repeatable=False),
    "model": Target(foreign.models, _text(foreign.model)),
    "sources": Target(foreign.source_lists, foreign.sources),
    "entry": Target(kept.entries, kept.entry, repeatable=False),
    "journal": Target(kept.journals, kept.journal, repeatable=False),
    "manifest": Target(kept.manifests, kept.manifest, repeatable=False),
    "slices": Target(kept.slice_groups, kept.slices, repeatable=False),
    "folder": Target(foreign.folders, foreign.folder, repeatable=False),
    "dialect": Target(foreign.dialects, _text(foreign.dialect)),
    "messages": Target(foreign.conversations, foreign.messages, repeatable=False),
}
WORDS = [
    *(piece.encode("utf-8", "surrogatepass") for piece in PIECES),
    *(b"-- a.md --\n", b" -> ", b"_toc.yml", b"mkdocs.yml", b"file:///COURSE/", b'"old":null'),
    *(b"<style>", b"url(#", b"href=", b"xlink:", b"&#", b"\\62 ", b"<g id='"),
    *(b"@book{a, ", b" and ", b'" # "', b"\\input", b"<macro ", b"<choose>", b"variable='title'"),
    *(b"\\(", b"\\)", b"\\[", b"\\]", b"\\begin{align}", b"{{", b"[[", b":::x\n", b"!!! note\n"),
]
"""What Atheris puts into inputs besides what it finds itself."""
