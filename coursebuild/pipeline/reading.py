"""Reads texts and draws pages, one at a time, in this process or in a worker.

Entry point: `PageReader`: `read` takes a `SourceText` and returns its `DocumentSummary`, `draw`
takes a `PageRequest` and returns a `DrawnPage`. Both store what they make.

Documents that were read stay in memory, with their formulas, until their pages are drawn. A
document that an earlier build or another process has read is parsed again; its MathML comes from
the store. The modules that draw are imported when there is something to draw.
"""

from __future__ import annotations

import contextlib
import hashlib
import importlib
import threading
import zlib
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.checks.formulas import check_formulas, document_formulas
from coursebuild.core.engine.memo import Memo
from coursebuild.core.engine.tool import step_key, typesetter_digest
from coursebuild.core.files.resources import prepared_folder, template_texts
from coursebuild.core.model import Document, document_scripts
from coursebuild.core.model.results import Formula, MathError
from coursebuild.core.model.vocabulary import Words
from coursebuild.core.model.walk import without_prose
from coursebuild.core.pages.assets import Assets
from coursebuild.core.pages.folding import find_imports
from coursebuild.core.pages.formulas import equations_of
from coursebuild.core.pages.frame import parts_of
from coursebuild.core.pages.page_inputs import PageHead, PageInputs
from coursebuild.core.pages.record import PageRecord, record
from coursebuild.core.pages.renderer import Renderer, Texts, known_mathml
from coursebuild.core.pages.urls import Place
from coursebuild.core.registry import summarize
from coursebuild.core.text.diagnostics import Diagnostic, Parsed
from coursebuild.core.text.source import Source, key_of
from coursebuild.core.values import decode, encode
from coursebuild.pipeline.fingerprints import document_fingerprint, notes_fingerprint

if TYPE_CHECKING:
    from coursebuild.core.pages.context import PageContext
    from coursebuild.core.run.v8 import MathEngine

SUMMARIES, PAGES = "summaries", "pages"
"""Kinds of entries in the store. They are not shared with other machines: making them is quick."""
_MATHML = "mathml"
"""Likewise. An entry has all formulas of a text: writing one for each formula would take as long as
making them."""
ROOM = 1_500_000
"""Characters of documents that wait unpacked to be drawn, at some twenty bytes a character. Further
ones wait packed, at one byte a character: unpacking takes less time than parsing again."""


class SourceText(Struct, frozen=True):
    """The text of a document, and how it is parsed."""

    source: Source
    callouts: frozenset[str]
    lesson: bool
    words: Words
    key: str
    """A hash of all that its summary depends on."""

    @classmethod
    def of(
        cls, source: Source, callouts: frozenset[str], *, lesson: bool, words: Words
    ) -> SourceText:
        """A text with its key."""
        key = step_key("summary", lesson, callouts, encode(words), source.path, source.digest)
        return cls(source, callouts, lesson, words, key)

    def parse(self) -> Parsed[Document]:
        """Return the document that the text holds, and what is wrong in it."""
        from coursebuild.core.syntax.document import parse_document

        return parse_document(self.source, self.callouts, lesson=self.lesson, words=self.words)


class DocumentSummary(Struct, frozen=True):
    """What is known of a document beyond its own page, and what is wrong in it."""

    document: Document
    """Without its prose; see `without_prose`. What features note of it is in `notes`."""
    diagnostics: tuple[Diagnostic, ...]
    """With those of its formulas."""
    imports: tuple[tuple[str, tuple[str, ...]], ...]
    """Paths of scripts, each with the modules that it imports."""
    fingerprint: str
    """A hash of what other pages can see of it; see `pipeline.fingerprints`."""
    notes: dict[str, bytes]
    """What features note of it (`Feature.summary`), by their names; encoded."""
    notes_fingerprint: str

    def with_notes(self) -> DocumentSummary:
        """The same with the notes in its document."""
        notes = _Notes(self.notes, self.document.source)
        return replace(self, document=replace(self.document, summaries=notes))


class _Notes(Mapping[str, Struct]):
    """What features note of a document, decoded on demand: after an edit few notes are needed."""

    def __init__(self, encoded_notes: Mapping[str, bytes], source: Source) -> None:
        self._encoded_notes = encoded_notes
        self._source = source
        self._notes: dict[str, Struct] = {}

    def __getitem__(self, feature: str) -> Struct:
        if feature not in self._notes:
            note = decode(self._encoded_notes[feature], Struct, self._source)
            assert note is not None, "what was just encoded can be decoded"
            self._notes[feature] = note
        return self._notes[feature]

    def __iter__(self) -> Iterator[str]:
        return iter(self._encoded_notes)

    def __len__(self) -> int:
        return len(self._encoded_notes)


class PageRequest(Struct, frozen=True):
    """A page to be drawn."""

    encoded_inputs: bytes
    """Its key is made from them."""
    text: SourceText | None
    """The text of its document, if it has one."""
    language: str
    """Of the interface."""
    base_url: str
    templates: Texts
    """The course's own templates."""
    key: str
    """The key under which it is stored: a hash of all the others, and of the tool."""

    @classmethod
    def of(
        cls,
        inputs: PageInputs,
        text: SourceText | None,
        language: str,
        base_url: str,
        templates: Texts,
    ) -> PageRequest:
        """A request with its key."""
        encoded_inputs, text_key = encode(inputs), "" if text is None else text.key
        key = step_key("page", language, base_url, templates, encoded_inputs, text_key)
        return cls(encoded_inputs, text, language, base_url, templates, key)


class DrawnPage(Struct, frozen=True):
    """A page as it is stored."""

    head: PageHead
    parts: tuple[str, ...]
    """See `frame.parts_of`."""
    record: PageRecord
    """What the site must know of it."""
    notes: dict[str, bytes]
    """See `page_notes`."""
    body: bytes
    """UTF-8."""


class _TypesetDocument(Struct, frozen=True):
    """A document with all its text, and with its formulas as MathML."""

    document: Document
    diagnostics: tuple[Diagnostic, ...]
    formulas: dict[Formula, str | MathError]


_HEAVY = (
    "coursebuild.core.run.v8",
    "coursebuild.core.pages.draw",
    "coursebuild.core.pages.highlight",
    "coursebuild.core.pages.document_inputs",
    "coursebuild.core.pages.page_list",
    "coursebuild.core.syntax.document",
)


def prepare_to_read(sample: SourceText) -> None:
    """Import and make what reading and drawing need, so that worker processes share it."""
    for name in _HEAVY:
        importlib.import_module(name)
    from coursebuild.core.pages.highlight import highlight_lines

    # Several modules prepare things at their first use.
    document = sample.parse().value
    highlight_lines("python", "x")
    if document_formulas(document):
        from coursebuild.core.run.v8 import start

        start()


def kept_formulas(store: Memo, path: str) -> dict[Formula, str]:
    """The MathML of the formulas that the text at a path had when it was last read."""
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
        self._undrawn_documents: dict[str, tuple[str, _TypesetDocument | bytes]] = {}
        """Documents that were read and not drawn yet, by path, each with the key of its text; those
        for which there was no room are packed."""
        self._room = ROOM
        self._renderers: dict[tuple[str, Texts], Renderer] = {}

    def close(self) -> None:
        """End the engine that typesets formulas; it starts again when it is needed."""
        if self._engine is not None:
            self._engine.close()
            self._engine = None

    def answer(self, request: SourceText | PageRequest) -> bytes:
        """Return the summary of a text, or the record of a page, encoded."""
        if isinstance(request, SourceText):
            return self.read(request)
        return encode(self.draw(request).record)

    # --- reading

    def read(self, text: SourceText) -> bytes:
        """Return the summary of a text, encoded."""
        with self._lock:
            whole = self._parse_and_typeset(text)
            formula_diagnostics = check_formulas(whole.document, whole.formulas)
            mathml = known_mathml(whole.formulas)
            notes = summarize(whole.document, mathml)
            equations = equations_of(whole.document, mathml)
            summary_document = without_prose(whole.document)
            summary_document = replace(summary_document, equations=equations, summaries={})
            diagnostics = (*whole.diagnostics, *formula_diagnostics, *notes.diagnostics)
            scripts = document_scripts(whole.document)
            imports = tuple((s.path, tuple(sorted(find_imports(s.code.text)))) for s in scripts)
            summary = DocumentSummary(
                summary_document,
                diagnostics,
                imports,
                document_fingerprint(summary_document),
                {feature: encode(note) for feature, note in notes.value.items()},
                notes_fingerprint(notes.value),
            )
            data = encode(summary)
            if not formula_diagnostics:  # a formula that took too long may not do so again
                self._store.put(SUMMARIES, text.key, data)
            self._keep_until_drawn(text, whole)
            return data

    def _keep_until_drawn(self, text: SourceText, whole: _TypesetDocument) -> None:
        """Keep a document in memory until its page is drawn."""
        size = len(text.source.text)
        if size <= self._room:
            self._undrawn_documents[text.source.path] = text.key, whole
            self._room -= size
        else:
            with contextlib.suppress(TypeError):  # a feature's block holds something else
                self._undrawn_documents[text.source.path] = (
                    text.key,
                    zlib.compress(encode(whole), 1),
                )

    def _parse_and_typeset(self, text: SourceText) -> _TypesetDocument:
        """Return a document with its formulas, parsed now or when it was last read."""
        key, whole = self._undrawn_documents.pop(text.source.path, ("", None))
        if isinstance(whole, _TypesetDocument):
            self._room += len(whole.document.source.text)
        elif whole is not None and key == text.key:
            whole = decode(zlib.decompress(whole), _TypesetDocument, text.source)
        if isinstance(whole, _TypesetDocument) and key == text.key:
            return whole
        parsed_text = text.parse()
        formulas = document_formulas(parsed_text.value)
        return _TypesetDocument(
            parsed_text.value, parsed_text.diagnostics, self._typeset(text.source.path, formulas)
        )

    def _typeset(self, path: str, formulas: Sequence[Formula]) -> dict[Formula, str | MathError]:
        """Return the MathML of formulas; what the text at this path had before is in the store."""
        if not formulas:
            return {}
        mathml_before = kept_formulas(self._store, path)
        new = [formula for formula in formulas if formula not in mathml_before]
        if not new:
            return {formula: mathml_before[formula] for formula in formulas}
        mathml = {**mathml_before, **dict(zip(new, self._start_engine().typeset(new), strict=True))}
        mathml_of_text = {formula: mathml[formula] for formula in formulas}
        without_errors = {
            formula: html for formula, html in mathml_of_text.items() if isinstance(html, str)
        }
        self._store.put(_MATHML, _formulas_key(path), encode(without_errors))
        return mathml_of_text

    def _start_engine(self) -> MathEngine:
        from coursebuild.core.run.v8 import MathEngine

        if self._engine is None:
            self._engine = MathEngine()
        return self._engine

    # --- drawing

    def draw(self, request: PageRequest) -> DrawnPage:
        """Draw a page and store it."""
        from coursebuild.core.pages.added_files import page_notes
        from coursebuild.core.pages.draw import draw

        inputs = decode(request.encoded_inputs, PageInputs)
        assert inputs is not None, "what was just encoded can be decoded"
        with self._lock:
            whole = None if request.text is None else self._parse_and_typeset(request.text)
            document = None if whole is None else whole.document
            renderer = self._renderer_for(request.language, request.templates, whole)
            head, html, context = draw(inputs, document, renderer)
            page_record, body = record(head, html, request.base_url, context)
            notes = page_notes(inputs, context, body)
            digests = ((name, hashlib.sha256(note).hexdigest()) for name, note in notes.items())
            page_record = replace(page_record, notes=tuple(digests))
            parts = parts_of(body, head.kind)
            page = DrawnPage(head, parts, page_record, notes, body.encode())
            self._store.put(PAGES, request.key, encode(page))
            return page

    def page_context(
        self, text: SourceText, inputs: PageInputs, language: str, templates: Texts
    ) -> PageContext:
        """Return what is needed to draw parts of a document, with all its text."""
        from coursebuild.core.pages.context import PageContext

        assert inputs.document_inputs is not None, "a page with a document shows it"
        whole = self._parse_and_typeset(text)
        renderer = self._renderer_for(language, templates, whole)
        return PageContext(
            renderer, inputs.document_inputs, Place(inputs.head.path), whole.document
        )

    def _renderer_for(
        self, language: str, templates: Texts, whole: _TypesetDocument | None
    ) -> Renderer:
        """Return a renderer with words, templates, and the formulas of a document."""
        if (language, templates) not in self._renderers:
            assets = Assets(template_texts(), {}, prepared_folder())
            self._renderers = {(language, templates): assets.renderer(language, templates)}
        renderer = self._renderers[language, templates]
        return renderer if whole is None else replace(renderer, formulas=whole.formulas)
