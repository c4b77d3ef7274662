"""From text to parsed and typeset document, its summary and its page.

1. `read_documents` gives the summaries of texts, from the store where they were read before. The
   others are read here, or by worker processes where there are many.
2. `draw` draws pages. Whoever has read a document, this process or a worker, keeps it packed, with
   its formulas, and draws its page. A worker is a copy of this process with the same reader.
3. A document that an earlier build has read is parsed again when its page is drawn; its MathML
   comes from the store.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import pickle
import threading
from collections.abc import Callable, Iterator, Sequence
from itertools import chain, islice
from typing import TYPE_CHECKING, Self, TypeAlias, TypeVar

from msgspec import Struct
from msgspec.structs import astuple, replace

from coursebuild.core.checks.formulas import (
    check_formulas,
    check_macros,
    document_formulas,
)
from coursebuild.core.checks.lessons import check_course
from coursebuild.core.engine.page_pool import Workers, can_fork
from coursebuild.core.engine.store import Store, value_reader
from coursebuild.core.engine.tool import step_key, typesetter_digest
from coursebuild.core.files.resources import prepared_folder, template_texts
from coursebuild.core.model import Course, Declarations, Document, document_scripts
from coursebuild.core.model.course import Words
from coursebuild.core.model.results import Formula, MathError
from coursebuild.core.model.walk import without_prose
from coursebuild.core.pages.assets import Assets
from coursebuild.core.pages.context import PageContext, PageRecord
from coursebuild.core.pages.materials import renderer_for
from coursebuild.core.pages.numbering import items_of
from coursebuild.core.pages.renderer import Renderer, Texts, direction, known_mathml
from coursebuild.core.pages.typography import isolate_formulas
from coursebuild.core.pages.urls import Place
from coursebuild.core.registry import features, summarize
from coursebuild.core.syntax.coursemap import parse_course_map
from coursebuild.core.syntax.declarations import parse_declarations
from coursebuild.core.text.diagnostics import Diagnostic, Parsed
from coursebuild.core.text.python_code import find_imports
from coursebuild.core.text.source import Source, key_of
from coursebuild.core.values import decode, encode
from coursebuild.pipeline.options import Options
from coursebuild.pipeline.requests import (
    DocumentSummary,
    DrawnPage,
    PageRequest,
    SourceText,
    course_fingerprint,
    document_fingerprint,
    notes_fingerprint,
)

if TYPE_CHECKING:
    from coursebuild.core.run.typesetting import MathEngine

Value = TypeVar("Value")

_SUMMARIES, _PAGES, _MAPS, _DECLARATIONS = "summaries", "pages", "maps", "declarations"
"""Kinds of entries in the store. They are not shared with other machines: making them is quick."""
_MATHML = "mathml"
"""Likewise. An entry has all formulas of a text: writing one for each formula would take as long as
making them."""
_CLEAN_COURSES = "checked"
"""Likewise, for courses in which nothing was wrong."""
_MIN_PARALLEL = 8
"""Texts or pages for which worker processes are worth their start."""


class _WholeDocument(Struct, frozen=True):
    """A document with all its text, and with its formulas as MathML."""

    document: Document
    diagnostics: tuple[Diagnostic, ...]
    formulas: dict[Formula, str | MathError]


_Request: TypeAlias = SourceText | PageRequest
_Answer: TypeAlias = DocumentSummary | PageRecord


class Reader:
    """Reads the documents of a course and draws their pages, whichever thread asks."""

    def __init__(self, options: Options) -> None:
        self._store = options.store
        self._stage = options.progress.stage
        self._jobs = options.jobs
        self._summaries: dict[str, tuple[str, DocumentSummary]] = {}
        """By path, each with the key of its text."""
        self._fingerprints: tuple[Course, tuple[str | None, str | None]] | None = None
        self._undrawn_documents: dict[str, tuple[str, bytes]] = {}
        """Documents that were read here and not drawn yet, by path, each with the key of its text.
        They are packed, which takes little room: packing takes 0.4 ms, parsing again 7."""
        self._lock = threading.RLock()
        self._engine: MathEngine | None = None
        self._renderers: dict[tuple[str, Texts, bool], Renderer] = {}
        self._workers: Workers[_Request, _Answer] | None = None
        self._worker_numbers: dict[str, int] = {}
        """The number of the worker that has read a text, by the text's path."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        """End the workers, which frees their memory with the documents that they have read."""
        if self._engine is not None:
            self._engine.close()
        if self._workers is not None:
            self._workers.close()
            self._workers = None
            self._worker_numbers.clear()

    # --- the course

    @property
    def imports(self) -> dict[str, frozenset[str]]:
        """The modules that each script imports, by its path; of the documents read so far."""
        summaries = (*self._summaries.values(),)  # to which another thread may add
        imports = (pair for _, summary in summaries for pair in summary.imports)
        return {path: frozenset(modules) for path, modules in imports}

    def fingerprints(self, course: Course) -> tuple[str | None, str | None]:
        """The fingerprints of a course whose documents were read here; `None` for any other course.

        The first is of the course without what features note of its documents, which few pages
        show.
        """
        if self._fingerprints is None or self._fingerprints[0] is not course:
            summaries = {path: summary for path, (_, summary) in self._summaries.items()}
            bare = course_fingerprint(
                course, ((s.document, s.fingerprint) for s in summaries.values())
            )
            whole = None
            if bare is not None:
                paths = (document.source.path for document in course.documents)
                whole = key_of(bare, *(summaries[path].notes_fingerprint for path in paths))
            self._fingerprints = course, (bare, whole)
        return self._fingerprints[1]

    def check(self, course: Course) -> tuple[Diagnostic, ...]:
        """What `check_course` finds; a course that was found clean is not checked again."""
        key = step_key("checked course")
        state = (self.fingerprints(course)[1] or "").encode()
        if state and self._store.get(_CLEAN_COURSES, key, bytes) == state:
            return ()
        diagnostics = check_course(course)
        if state and not diagnostics:
            self._store.put(_CLEAN_COURSES, key, state)
        return diagnostics

    def read_map(self, source: Source) -> Parsed[Course | None]:
        """Return the course that a map describes, and what is wrong in it."""

        def typeset(formula: Formula) -> str | MathError:
            with self._lock:
                return self._typeset(source.path, [formula])[formula]

        def parse(source: Source) -> Parsed[Course | None]:
            course, diagnostics = astuple(parse_course_map(source))
            macros = course.macros if course is not None else {}
            return Parsed(course, (*diagnostics, *check_macros(macros, typeset)))

        return self._get_or_parse(_MAPS, Course, source, parse)

    def read_declarations(self, source: Source) -> Parsed[Declarations | None]:
        """Return what a file beside a model declares, and what is wrong in it."""
        return self._get_or_parse(_DECLARATIONS, Declarations, source, parse_declarations)

    def _get_or_parse(
        self,
        kind: str,
        type: type[Value],
        source: Source,
        parse: Callable[[Source], Parsed[Value | None]],
    ) -> Parsed[Value | None]:
        key = step_key(kind, source.path, source.text)

        def read(data: bytes) -> Parsed[Value | None] | None:
            content = decode(data, Parsed, source)
            return content if content and isinstance(content.value, type | None) else None

        entry = self._store.get(kind, key, read)
        if entry is not None:
            return entry
        result = parse(source)
        self._store.put(kind, key, encode(result))
        return result

    # --- documents

    def read_documents(
        self, sources: Sequence[tuple[Source, bool, Words]], callouts: frozenset[str]
    ) -> list[Parsed[Document]]:
        """Return documents without their prose, and what is wrong in them.

        Each text is given with whether it is a lesson, and the words by which it is read.
        """
        texts = [
            SourceText.of(source, callouts, lesson=lesson, words=words)
            for source, lesson, words in sources
        ]
        summaries = {text.key: self._find_summary(text) for text in texts}
        missing = [text for text in texts if summaries[text.key] is None]
        if len(missing) >= _MIN_PARALLEL:
            # What is imported here, worker processes share, and what is prepared at its first use.
            from coursebuild.core.pages.listings import highlight_lines

            self._whole_document(missing[0])
            highlight_lines("python", "x")
        answers = self._answer_all("reading lessons and pages", iter(missing))
        for text, (summary, worker) in zip(missing, answers, strict=True):
            assert isinstance(summary, DocumentSummary)
            summaries[text.key] = summary
            if worker is not None:
                self._worker_numbers[text.source.path] = worker
        parsed_documents = []
        for text in texts:
            text_summary = summaries[text.key]
            assert text_summary is not None
            self._summaries[text.source.path] = text.key, text_summary
            parsed_documents.append(Parsed(text_summary.document, text_summary.diagnostics))
        return parsed_documents

    def _find_summary(self, text: SourceText) -> DocumentSummary | None:
        key, summary = self._summaries.get(text.source.path, ("", None))
        if key == text.key:
            return summary
        return self._store.get(
            _SUMMARIES, text.key, lambda data: DocumentSummary.from_bytes(data, text.source)
        )

    def _read(self, text: SourceText) -> DocumentSummary:
        """Read a text, store its summary, and keep the document until its page is drawn."""
        with self._lock:
            whole = self._whole_document(text)
            formula_diagnostics = check_formulas(whole.document, whole.formulas)
            mathml = known_mathml(whole.formulas)
            notes = summarize(whole.document, mathml)
            bare = replace(
                without_prose(whole.document),
                numbered_items=items_of(whole.document, mathml),
                summaries=notes.value,
            )
            scripts = [s for s in document_scripts(whole.document) if s.is_python]
            summary = DocumentSummary(
                bare,
                (*whole.diagnostics, *formula_diagnostics, *notes.diagnostics),
                tuple((s.path, tuple(sorted(find_imports(s.code.text)))) for s in scripts),
                document_fingerprint(bare),
                notes_fingerprint(notes.value),
            )
            if not formula_diagnostics:  # a formula that took too long may not do so again
                self._store.put(_SUMMARIES, text.key, summary.to_bytes())
            with contextlib.suppress(*_UNPACKABLE):
                data = pickle.dumps(whole, pickle.HIGHEST_PROTOCOL)
                self._undrawn_documents[text.source.path] = text.key, data
            return summary

    def _whole_document(self, text: SourceText) -> _WholeDocument:
        """Return a document with its formulas, parsed now or when it was last read."""
        key, data = self._undrawn_documents.pop(text.source.path, ("", b""))
        if key == text.key:
            whole: _WholeDocument = pickle.loads(data)  # never from the store
            return whole
        parsed_text = text.parse()
        formulas = document_formulas(parsed_text.value)
        return _WholeDocument(
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
        if self._engine is None:
            from coursebuild.core.run.typesetting import MathEngine

            self._engine = MathEngine()
        mathml = {**mathml_before, **dict(zip(new, self._engine.typeset(new), strict=True))}
        mathml_of_text = {formula: mathml[formula] for formula in formulas}
        without_errors = {
            formula: html for formula, html in mathml_of_text.items() if isinstance(html, str)
        }
        self._store.put_value(_MATHML, _formulas_key(path), without_errors)
        return mathml_of_text

    # --- pages

    def draw(self, pages: Iterator[PageRequest]) -> Iterator[PageRecord]:
        """Draw pages and store them; return their records, in order.

        Requests are taken from the iterator while pages are drawn.
        """
        for answer, _ in self._answer_all("drawing pages", pages):
            assert isinstance(answer, PageRecord)
            yield answer

    def find_page(self, key: str) -> DrawnPage | None:
        """Return the page stored under a key, if there is one."""
        return self._store.peek(_PAGES, key, value_reader(DrawnPage))

    def draw_page(self, request: PageRequest) -> DrawnPage:
        """Draw a page here, and store it."""
        # A check draws none.
        from coursebuild.core.pages.draft_writer import DraftWriter
        from coursebuild.core.pages.page_writer import PageWriter, draw
        from coursebuild.core.pages.record import record

        with self._lock:
            whole = None if request.text is None else self._whole_document(request.text)
            document = None if whole is None else whole.document
            renderer = self._renderer_for(request, whole)
            inputs = request.inputs
            writer: Callable[..., PageWriter] = PageWriter
            if request.mistakes:
                writer = functools.partial(DraftWriter, mistakes=request.mistakes)
            head, html, context = draw(inputs, document, renderer, writer)
            body = isolate_formulas(html) if direction(request.language) == "rtl" else html
            page_record, body = record(head, body, request.base_url, context)
            notes = {
                f.name: note
                for f in features()
                if f.note is not None and (note := f.note(inputs, context, body))
            }
            digests = ((name, hashlib.sha256(note).hexdigest()) for name, note in notes.items())
            page_record = replace(page_record, notes=tuple(digests))
            page = DrawnPage(head, page_record, notes, body.encode())
            self._store.put_value(_PAGES, request.key, page)
            return page

    def page_context(self, request: PageRequest) -> PageContext:
        """Return what is needed to draw parts of a page's document, with all its text."""
        from coursebuild.core.pages.page_writer import PageWriter

        inputs = request.inputs
        assert request.text is not None and inputs.document_inputs is not None
        with self._lock:
            whole = self._whole_document(request.text)
            renderer = self._renderer_for(request, whole)
        return PageWriter(renderer, inputs.document_inputs, Place(inputs.head.path), whole.document)

    def _renderer_for(self, request: PageRequest, whole: _WholeDocument | None) -> Renderer:
        kind = request.language, request.templates, request.is_manual
        if kind not in self._renderers:
            assets = Assets(template_texts(), {}, prepared_folder())
            new = renderer_for(
                assets, request.language, request.templates, is_manual=request.is_manual
            )
            if len(self._renderers) > 8:  # as many as a preview made of changed templates
                self._renderers.clear()
            self._renderers[kind] = new
        renderer = self._renderers[kind]
        return renderer if whole is None else replace(renderer, formulas=whole.formulas)

    # --- here, or in worker processes

    def _answer(self, request: _Request) -> _Answer:
        return (
            self._read(request)
            if isinstance(request, SourceText)
            else self.draw_page(request).record
        )

    def _answer_all(
        self, name: str, requests: Iterator[_Request]
    ) -> Iterator[tuple[_Answer, int | None]]:
        """Answer requests, by workers where there are many; name the worker of each answer."""
        first = tuple(islice(requests, max(_MIN_PARALLEL, self._jobs * _MIN_PARALLEL // 2)))
        requests = chain(first, requests)
        is_worth_it = len(first) >= _MIN_PARALLEL and self._jobs > 1
        # Before the stage begins, which may start a thread: a fork does not copy threads.
        if self._engine is not None:
            self._engine.close()
        if self._workers is None and is_worth_it and can_fork():
            count = min(self._jobs, -(-2 * len(first) // _MIN_PARALLEL))
            self._workers = Workers(self._answer, count)
        if not first:
            return
        with self._stage(name):
            if self._workers is None:
                yield from ((self._answer(request), None) for request in requests)
            else:
                yield from self._workers.map(map(self._assign, requests))

    def _assign(self, request: _Request) -> tuple[int | None, _Request]:
        """A request with the number of the worker that has its document, if any."""
        text = request.text if isinstance(request, PageRequest) else None
        worker = None if text is None else self._worker_numbers.get(text.source.path)
        return worker, request


_UNPACKABLE = (pickle.PicklingError, AttributeError, TypeError, ValueError, RecursionError)
"""What packing a block of a feature may raise, if something in it is no plain value."""


def kept_formulas(store: Store, path: str) -> dict[Formula, str]:
    """The MathML of the formulas that the text at a path had when it was last read."""
    return store.get_value(_MATHML, _formulas_key(path), dict[Formula, str]) or {}


def _formulas_key(path: str) -> str:
    return key_of(typesetter_digest(), path)
