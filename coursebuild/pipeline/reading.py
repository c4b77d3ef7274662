"""Texts read and pages drawn, one at a time, here or in a copy of this process.

Entry point: `PageReader`: `read` takes a `SourceText` and gives its `DocumentSummary`, `draw` takes
a `PageRequest` and gives a `DrawnPage`. Both keep what they make.

A document and its formulas stay for the drawing. Those that an earlier build has read, or another
process, are parsed again, and their MathML comes from the store. What draws is imported when there
is something to draw.
"""

from __future__ import annotations

import contextlib
import hashlib
import importlib
import threading
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.checks.formulas import check_formulas, document_formulas
from coursebuild.core.engine.memo import Memo
from coursebuild.core.engine.prepared import prepared_folder
from coursebuild.core.engine.tool import step_key, typesetter_digest
from coursebuild.core.files.resources import template_texts
from coursebuild.core.model import Document, Script, document_blocks
from coursebuild.core.model.results import Formula, MathError
from coursebuild.core.model.summary import without_prose
from coursebuild.core.pages.assets import strings_for
from coursebuild.core.pages.equations import equations_of
from coursebuild.core.pages.folding import find_imports
from coursebuild.core.pages.page_inputs import PageInputs
from coursebuild.core.pages.record import PageRecord, record
from coursebuild.core.pages.renderer import Renderer, known_mathml
from coursebuild.core.pages.templates import Texts, templates_of
from coursebuild.core.pages.urls import Place
from coursebuild.core.registry import summarize
from coursebuild.core.text.diagnostics import Diagnostic
from coursebuild.core.text.source import Source, key_of
from coursebuild.core.values import decode, encode
from coursebuild.pipeline.fingerprints import document_fingerprint, notes_fingerprint

if TYPE_CHECKING:
    from coursebuild.core.pages.context import PageContext
    from coursebuild.core.run.v8 import MathEngine

SUMMARIES, PAGES = "summaries", "pages"
"""Kinds of entries in the store. They stay on this machine, where they are made soon enough."""
_MATHML = "mathml"
"""Likewise. One has the formulas of a text: one for each formula would take as long to write as to
make."""
ROOM = 1_500_000
"""Characters of documents that wait to be drawn as they are, some twenty bytes each. Further ones
wait packed, in one byte each: to unpack one takes less time than to parse it again."""


class SourceText(Struct, frozen=True):
    """A text that holds a document."""

    source: Source
    callouts: frozenset[str]
    lesson: bool
    key: str
    """A hash of all that its summary depends on."""

    @classmethod
    def of(cls, source: Source, callouts: frozenset[str], *, lesson: bool) -> SourceText:
        """With its key."""
        key = step_key("summary", lesson, callouts, source.path, source.digest)
        return cls(source, callouts, lesson, key)


class DocumentSummary(Struct, frozen=True):
    """A parsed text: what others than its own page look at, and what is wrong in it."""

    document: Document
    """Without its prose; see `model.summary`. What features note of it is in `notes`."""
    diagnostics: tuple[Diagnostic, ...]
    """Those of formulas among them."""
    imports: tuple[tuple[str, tuple[str, ...]], ...]
    """Paths of scripts, each with the modules that it imports."""
    fingerprint: str
    """Of what others than its own page can see of it; see `pipeline.fingerprints`."""
    notes: dict[str, bytes]
    """What features note of it (`Feature.summary`), by their names: each as `encode` gives it."""
    notes_fingerprint: str

    def noted(self, again: Callable[[], Mapping[str, bytes]]) -> DocumentSummary:
        """With a document that has its notes; `again` makes them, where some cannot be decoded."""
        notes = _Notes(self.notes, self.document.source, again)
        return replace(self, document=replace(self.document, summaries=notes))


class _Notes(Mapping[str, Struct]):
    """What features note of a document, decoded when it is asked for: after an edit few are."""

    def __init__(
        self,
        packed: Mapping[str, bytes],
        source: Source,
        again: Callable[[], Mapping[str, bytes]],
    ) -> None:
        self._packed = packed
        self._source = source
        self._again = again

    def __getitem__(self, feature: str) -> Struct:
        found = decode(self._packed[feature], Struct, self._source)
        if found is None:
            self._packed = self._again()
            found = decode(self._packed[feature], Struct, self._source)
        assert found is not None, "what was just encoded can be decoded"
        return found

    def __iter__(self) -> Iterator[str]:
        return iter(self._packed)

    def __len__(self) -> int:
        return len(self._packed)


class PageRequest(Struct, frozen=True):
    """A page to be drawn."""

    packed: bytes
    """Its inputs, as its key is made from them."""
    text: SourceText | None
    """That of its document, if it has one."""
    language: str
    """Of the interface."""
    base_url: str
    templates: Texts
    """Those of the course's own."""
    key: str
    """Under which it is kept."""


class DrawnPage(Struct, frozen=True):
    """A page as it is kept."""

    record: PageRecord
    """What the site must know of it."""
    notes: dict[str, bytes]
    """See `page_notes`."""
    body: bytes
    """UTF-8."""


class _Whole(Struct, frozen=True):
    document: Document
    diagnostics: tuple[Diagnostic, ...]
    formulas: dict[Formula, str | MathError]


_HEAVY = (
    "coursebuild.core.run.v8",
    "coursebuild.core.pages.draw",
    "coursebuild.core.pages.highlight",
    "coursebuild.core.pages.lesson",
    "coursebuild.core.pages.pages",
    "coursebuild.core.syntax.document",
)


def prepare_to_read(sample: SourceText) -> None:
    """Import and make what reading and drawing need, so that copies of this process share it."""
    for name in _HEAVY:
        importlib.import_module(name)
    from coursebuild.core.pages.highlight import highlight_lines
    from coursebuild.core.syntax.document import parse_document

    # Much is made only when it is needed for the first time.
    read = parse_document(sample.source, sample.callouts, lesson=sample.lesson).value
    highlight_lines("python", "x")
    if document_formulas(read):
        from coursebuild.core.run.v8 import start

        start()


def kept_formulas(store: Memo, path: str) -> dict[Formula, str]:
    """MathML of the formulas that the text at a path had when it was last read."""
    key = _formulas_key(path)
    return store.get(_MATHML, key, lambda data: decode(data, dict[Formula, str])) or {}


def _formulas_key(path: str) -> str:
    return key_of(typesetter_digest(), path)


class PageReader:
    """Reads and draws, one thing at a time, whichever thread asks."""

    def __init__(self, store: Memo) -> None:
        self._store = store
        self._lock = threading.RLock()
        self._engine: MathEngine | None = None
        self._waiting: dict[str, tuple[str, _Whole | bytes]] = {}
        """Documents that were read and not drawn yet, by path, each with the key of its text;
        packed, where there was no room."""
        self._room = ROOM
        self._renderers: dict[tuple[str, Texts], Renderer] = {}

    def close(self) -> None:
        """End the engine that typesets formulas, until it is needed again."""
        if self._engine is not None:
            self._engine.close()
            self._engine = None

    def answer(self, request: SourceText | PageRequest) -> bytes:
        """The summary of a text, or the record of a page, encoded."""
        if isinstance(request, SourceText):
            return self.read(request)
        return encode(self.draw(request).record)

    # --- reading

    def read(self, text: SourceText) -> bytes:
        """The summary of a text, encoded."""
        with self._lock:
            whole = self._whole(text)
            found = check_formulas(whole.document, whole.formulas)
            mathml = known_mathml(whole.formulas)
            known = summarize(whole.document, mathml)
            equations = equations_of(whole.document, mathml)
            bare = without_prose(whole.document)
            bare = replace(bare, equations=equations, summaries={})
            wrong = (*whole.diagnostics, *found, *known.diagnostics)
            scripts = (b for b in document_blocks(whole.document) if isinstance(b, Script))
            imports = tuple((s.path, tuple(sorted(find_imports(s.code.text)))) for s in scripts)
            summary = DocumentSummary(
                bare,
                wrong,
                imports,
                document_fingerprint(bare),
                {feature: encode(note) for feature, note in known.value.items()},
                notes_fingerprint(known.value),
            )
            data = encode(summary)
            if not found:  # that a formula took too long may not happen again
                self._store.put(SUMMARIES, text.key, data)
            self._keep(text, whole)
            return data

    def _keep(self, text: SourceText, whole: _Whole) -> None:
        """Keep a document until it is drawn."""
        size = len(text.source.text)
        if size <= self._room:
            self._waiting[text.source.path] = text.key, whole
            self._room -= size
        else:
            with contextlib.suppress(TypeError):  # a feature's block holds something else
                self._waiting[text.source.path] = text.key, zlib.compress(encode(whole), 1)

    def _whole(self, text: SourceText) -> _Whole:
        """A document with its formulas."""
        key, known = self._waiting.pop(text.source.path, ("", None))
        if isinstance(known, _Whole):
            self._room += len(known.document.source.text)
        elif known is not None and key == text.key:
            known = decode(zlib.decompress(known), _Whole, text.source)
        if isinstance(known, _Whole) and key == text.key:
            return known
        from coursebuild.core.syntax.document import parse_document

        parsed = parse_document(text.source, text.callouts, lesson=text.lesson)
        formulas = document_formulas(parsed.value)
        return _Whole(parsed.value, parsed.diagnostics, self._typeset(text.source.path, formulas))

    def _typeset(self, path: str, formulas: Sequence[Formula]) -> dict[Formula, str | MathError]:
        """MathML; that of formulas which the text at this path had before is in the store."""
        if not formulas:
            return {}
        known = kept_formulas(self._store, path)
        new = [formula for formula in formulas if formula not in known]
        if not new:
            return {formula: known[formula] for formula in formulas}
        made = {**known, **dict(zip(new, self._started().typeset(new), strict=True))}
        found = {formula: made[formula] for formula in formulas}
        lasting = {formula: one for formula, one in found.items() if isinstance(one, str)}
        self._store.put(_MATHML, _formulas_key(path), encode(lasting))
        return found

    def _started(self) -> MathEngine:
        from coursebuild.core.run.v8 import MathEngine

        if self._engine is None:
            self._engine = MathEngine()
        return self._engine

    # --- drawing

    def draw(self, request: PageRequest) -> DrawnPage:
        """A page, its body, and what is noted of it."""
        from coursebuild.core.pages.added_files import page_notes
        from coursebuild.core.pages.draw import draw

        inputs = decode(request.packed, PageInputs)
        assert inputs is not None, "what was just encoded can be decoded"
        with self._lock:
            whole = None if request.text is None else self._whole(request.text)
            document = None if whole is None else whole.document
            renderer = self._renderer_for(request.language, request.templates, whole)
            head, html, context = draw(inputs, document, renderer)
            found, body = record(head, html, request.base_url)
            notes = page_notes(inputs, context, body)
            digests = ((name, hashlib.sha256(note).hexdigest()) for name, note in notes.items())
            found = replace(found, notes=tuple(digests))
            page = DrawnPage(found, notes, body.encode())
            self._store.put(PAGES, request.key, encode(page))
            return page

    def context(
        self, text: SourceText, inputs: PageInputs, language: str, templates: Texts
    ) -> PageContext:
        """A document with all its text, on its page."""
        from coursebuild.core.pages.context import PageContext

        assert inputs.document_inputs is not None, "a page with a document shows it"
        whole = self._whole(text)
        renderer = self._renderer_for(language, templates, whole)
        return PageContext(
            renderer, inputs.document_inputs, Place(inputs.head.path), whole.document
        )

    def _renderer_for(self, language: str, own: Texts, whole: _Whole | None) -> Renderer:
        """Words and templates, with the formulas of a document."""
        if (language, own) not in self._renderers:
            texts = template_texts()
            templates = templates_of(texts, prepared_folder(), own)
            strings = strings_for(texts, language)
            self._renderers = {(language, own): Renderer(strings, templates)}
        renderer = self._renderers[language, own]
        return renderer if whole is None else replace(renderer, formulas=whole.formulas)
