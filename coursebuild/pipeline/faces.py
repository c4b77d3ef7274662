"""What of a document, a course or its results can be seen from elsewhere, without its places.

Entry points: `outline_face`, of one document; `course_face`; `results_face`. Each is a hash.

A sentence that is added moves all that follows it, and nothing else in the course: no page but the
document's own shows where in its file something stands. So a value is hashed with its spans left
out, and with the text of its excerpts; where the hash is that of before, whatever was made from it
for other pages is that of before, and where nothing was found wrong nothing is wrong.
"""

from __future__ import annotations

import copyreg
import hashlib
import io
import pickle
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from coursebuild import model, results, source
from coursebuild.effects.tool import tool_digest
from coursebuild.model import (
    Course,
    Document,
    HtmlBlock,
    RawInline,
    block_inlines,
    document_blocks,
    walk_inlines,
)
from coursebuild.numerics.reports import Reports
from coursebuild.results import Results
from coursebuild.source import Excerpt, Source, Span


def _place(span: Span) -> tuple[type[tuple[()]], tuple[()]]:
    return tuple, ()


def _text(excerpt: Excerpt) -> tuple[type[str], tuple[str]]:
    return str, (excerpt.text,)


def _file(source: Source) -> tuple[type[str], tuple[str, str]]:
    return str, (source.path, source.text)


_PLACELESS: dict[type, Any] = {
    **copyreg.dispatch_table,
    Span: _place,
    Excerpt: _text,
    Source: _file,
}


_NAMED = sorted(
    {
        kind
        for names in (vars(model), vars(results), vars(source), {"": tuple})
        for kind in names.values()
        if isinstance(kind, type)
    },
    key=lambda kind: (kind.__module__, kind.__qualname__),
)
_NUMBERS = pickle.Pickler(io.BytesIO(), 5)
"""Knows these classes by number: else each value would be written with the name of its class, which
takes longer than the value."""
_NUMBERS.memo = {id(kind): (number, kind) for number, kind in enumerate(_NAMED)}


def _face(value: object, documents: Mapping[int, str] | None = None) -> str:
    """The same for values that are equal but for places; documents have the faces that are given.

    A set counts in the order that it happens to have, so that equal ones may differ: that costs
    time, and is never wrong.
    """
    out = io.BytesIO()
    pickler = pickle.Pickler(out, 5)
    pickler.fast = True  # what is written depends on what is equal, not on what is one object
    pickler.memo = _NUMBERS.memo
    known = documents or {}
    pickler.dispatch_table = {
        **_PLACELESS,
        Document: lambda document: (str, (document.source.path, known[id(document)])),
    }
    pickler.dump(value)
    return hashlib.sha256(out.getbuffer()).hexdigest()


def outline_face(skeleton: Document) -> str:
    """The face of a document, by its skeleton."""
    raw = tuple(_raw(skeleton))
    return _face((skeleton.blocks, skeleton.footnotes, skeleton.lexicon, raw))


def _raw(skeleton: Document) -> Iterator[str]:
    """HTML as its author wrote it, in which links are looked for: its span is where the text is."""
    for block in document_blocks(skeleton):
        if isinstance(block, HtmlBlock):
            yield block.span.text
        for inline in walk_inlines(block_inlines(block)):
            if isinstance(inline, RawInline):
                yield inline.span.text


def course_face(course: Course, documents: Iterable[tuple[Document, str]]) -> str | None:
    """The face of a course, given those of its documents; `None` where one of them is missing."""
    known = {id(document): face for document, face in documents}
    if not all(known.get(id(document)) for document in course.documents):
        return None
    return _face((tool_digest(), course), known)


def results_face(results: Results, reports: Reports) -> str:
    """The face of what was found, without how long it took and what nothing is made from."""
    runs = tuple((r.path, r.outcome, r.status, r.stdout, r.missing) for r in results.runs)
    verdicts = tuple(
        (v.recording.span.path, v.recording.script, v.status, v.comparison)
        for v in results.verdicts
    )
    labs = tuple(
        (
            lab.span.path,
            (lab.name, lab.lesson, lab.title, lab.status, lab.tried, lab.parity),
            (lab.module, lab.config, lab.mjb, lab.static, lab.export, lab.unexported),
        )
        for lab in results.labs
    )
    rest = results.formulas, results.models, results.python, results.engine
    return _face((tool_digest(), runs, verdicts, labs, rest, reports))
