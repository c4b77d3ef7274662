"""Documents read and pages drawn, one request at a time, here or in a copy of this process.

Entry point: `PageReader`, whose `answer` takes a `Task` or a `Draw`.

1. `Task`: the text is parsed and its formulas are typeset; the summary is kept in the store.
2. `Draw`: a page is drawn from its inputs and its document; body and record are kept in the store.
3. The document and its formulas stay for the drawing. Those that an earlier build has read, or
   another process, are parsed again, and their MathML comes from the store.

What draws is imported when there is something to draw.
"""

from __future__ import annotations

import hashlib
import importlib
import threading
from collections.abc import Sequence
from typing import TYPE_CHECKING, assert_never

import msgspec
from markupsafe import Markup
from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.checks.formulas import document_formulas, formula_findings
from coursebuild.core.engine.memo import Memo
from coursebuild.core.engine.prepared import prepared_folder
from coursebuild.core.engine.tool import step_key, typesetter_digest
from coursebuild.core.files.resources import template_texts
from coursebuild.core.model import Document, Script, document_blocks
from coursebuild.core.model.results import Formula, MathError
from coursebuild.core.model.summary import without_prose
from coursebuild.core.pages.assets import strings_for
from coursebuild.core.pages.equations import equations_of
from coursebuild.core.pages.page_inputs import PageInputs
from coursebuild.core.pages.record import PageRecord, record
from coursebuild.core.pages.templates import templates_of
from coursebuild.core.pages.tools import Tools, known_mathml, mark_now
from coursebuild.core.pages.urls import Place
from coursebuild.core.pages.zips import imports
from coursebuild.core.registry import summarize
from coursebuild.core.run.versions import package_version
from coursebuild.core.text.diagnostics import Diagnostic
from coursebuild.core.text.source import key_of
from coursebuild.core.values import decode, encode
from coursebuild.pipeline.fingerprints import document_fingerprint
from coursebuild.pipeline.tasks import (
    PAGES,
    SUMMARIES,
    Answer,
    DocumentSummary,
    Draw,
    Drawn,
    KeptPage,
    Later,
    Request,
    Task,
)

if TYPE_CHECKING:
    from coursebuild.core.pages.context import PageContext
    from coursebuild.core.run.v8 import MathEngine

_MATHML, _CODE = "mathml", "code"
"""Kinds of entries in the store. One has the formulas of a text: one for each formula would take as
long to write as to make."""
_ROOM = 700_000
"""Characters of documents that wait to be drawn, some 25 bytes each. Further ones are parsed
again, so that memory does not grow with the course."""


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


def prepare_to_read(sample: Task) -> None:
    """Import and make what reading and drawing need, so that copies of this process share it."""
    for name in _HEAVY:
        importlib.import_module(name)
    from coursebuild.core.syntax.document import parse_document

    # Much is made only when it is needed for the first time.
    read = parse_document(sample.source, sample.callouts, lesson=sample.lesson).value
    mark_now("python", 'f"{x}"\n')
    imports("x\n")
    if document_formulas(read):
        from coursebuild.core.run.v8 import start

        start()


class PageReader:
    """Reads and draws; formulas are typeset by an engine, which is closed at last."""

    def __init__(self, store: Memo) -> None:
        self._store = store
        self._lock = threading.RLock()
        self._engine: MathEngine | None = None
        self._waiting: dict[str, tuple[Task, _Whole]] = {}
        """Documents that were read and not drawn yet, by path."""
        self._room = _ROOM
        self._tools: dict[str, Tools] = {}

    def close(self) -> None:
        """End the engine that typesets formulas, until it is needed again."""
        if self._engine is not None:
            self._engine.close()
            self._engine = None

    def answer(self, request: Request) -> Answer:
        """Do what is asked; one thing at a time, whichever thread asks."""
        if isinstance(request, Later):
            return self.answer(request.make())
        with self._lock:
            return self._answer(request)

    def _answer(self, request: Task | Draw) -> Answer:
        match request:
            case Task():
                return self._read(request)
            case Draw():
                return self._draw(request)
            case _:
                assert_never(request)

    # --- reading

    def _summary(self, whole: _Whole) -> DocumentSummary:
        found = formula_findings(whole.document, whole.formulas)
        mathml = known_mathml(whole.formulas)
        known = summarize(whole.document, mathml)
        scripts = (b for b in document_blocks(whole.document) if isinstance(b, Script))
        bare = without_prose(whole.document)
        equations = equations_of(whole.document, mathml)
        bare = replace(bare, equations=equations, summaries=known.value)
        return DocumentSummary(
            document=bare,
            diagnostics=(*whole.diagnostics, *found, *known.diagnostics),
            imports=tuple((s.path, tuple(sorted(imports(s.code.text)))) for s in scripts),
            lasting=not found,
            fingerprint=document_fingerprint(bare),
        )

    def _read(self, task: Task) -> bytes:
        whole = self._whole(task)
        summary = self._summary(whole)
        data = encode(summary)
        if summary.lasting:  # that a formula took too long may not happen again
            self._store.put(SUMMARIES, task.key, data, local=True)
        self._keep(task, whole)
        return data

    def _keep(self, task: Task, whole: _Whole) -> None:
        """Keep a document until it is drawn, as far as there is room."""
        size = len(task.source.text)
        if size <= self._room:
            self._waiting[task.source.path] = task, whole
            self._room -= size

    def _whole(self, task: Task) -> _Whole:
        """A document with its formulas."""
        known = self._waiting.pop(task.source.path, None)
        if known is not None:
            self._room += len(known[0].source.text)
            if known[0].key == task.key:
                return known[1]
        from coursebuild.core.syntax.document import parse_document

        parsed = parse_document(task.source, task.callouts, lesson=task.lesson)
        formulas = document_formulas(parsed.value)
        return _Whole(parsed.value, parsed.diagnostics, self._typeset(task.source.path, formulas))

    def _typeset(self, path: str, formulas: Sequence[Formula]) -> dict[Formula, str | MathError]:
        """MathML; that of formulas which the text at this path had before is in the store."""
        if not formulas:
            return {}
        key = key_of(typesetter_digest(), path)
        known: dict[Formula, str] = decode(self._store.get(_MATHML, key, local=True), dict) or {}
        new = [formula for formula in formulas if formula not in known]
        if not new:
            return {formula: known[formula] for formula in formulas}
        made = {**known, **dict(zip(new, self._started().typeset(new), strict=True))}
        found = {formula: made[formula] for formula in formulas}
        lasting = {formula: one for formula, one in found.items() if isinstance(one, str)}
        self._store.put(_MATHML, key, encode(lasting), local=True)
        return found

    def _started(self) -> MathEngine:
        from coursebuild.core.run.v8 import MathEngine

        if self._engine is None:
            self._engine = MathEngine()
        return self._engine

    # --- drawing

    def draw(self, request: Draw) -> Drawn:
        """A page, its body, and what is noted of it."""
        with self._lock:
            return self._drawn(request)

    def page(self, request: Draw) -> tuple[PageRecord, str]:
        """A page and its body, of which neither the search nor other files are to know yet."""
        from coursebuild.core.pages.draw import draw

        with self._lock:
            document, tools = None, self._tools_for(request.language)
            if request.task is not None:
                whole = self._whole(request.task)
                self._keep(request.task, whole)
                document, tools = whole.document, replace(tools, formulas=whole.formulas)
            return record(draw(request.inputs, document, tools), request.base_url)

    def _drawn(self, request: Draw) -> Drawn:
        from coursebuild.core.pages.added_files import page_notes
        from coursebuild.core.pages.draw import draw_whole

        whole = self._whole(request.task) if request.task is not None else None
        tools = self._tools_for(request.language)
        document = None
        if whole is not None:
            tools, document = replace(tools, formulas=whole.formulas), whole.document
        inputs = request.inputs
        draft, page = draw_whole(inputs, document, tools)
        found, body = record(draft, request.base_url)
        notes = page_notes(inputs, page, body)
        digests = tuple((name, hashlib.sha256(note).hexdigest()) for name, note in notes.items())
        found = replace(found, notes=digests)
        return Drawn(found, body, notes)

    def _draw(self, request: Draw) -> bytes:
        drawn = self._drawn(request)
        page = KeptPage.of(drawn)
        self._store.put(PAGES, request.key, msgspec.msgpack.encode(page), local=True)
        return page.packed_record

    def context(self, task: Task, inputs: PageInputs, language: str) -> PageContext:
        """A document with all its text, on its page."""
        from coursebuild.core.pages.context import PageContext

        assert inputs.shown is not None, "a page with a document shows it"
        whole = self._whole(task)
        tools = replace(self._tools_for(language), formulas=whole.formulas)
        return PageContext.made(tools, inputs.shown, Place(inputs.path), whole.document)

    def _tools_for(self, language: str) -> Tools:
        if language not in self._tools:
            self._tools[language] = drawing_tools(self._store, language)
        return self._tools[language]


def drawing_tools(store: Memo, language: str) -> Tools:
    """Words, templates and the store's marked code."""
    texts = template_texts()
    templates = templates_of(texts, prepared_folder())
    return Tools(strings_for(texts, language), templates, mark=_Marks(store))


class _Marks:
    """Code whose tokens are marked, from the store where it was marked before."""

    def __init__(self, store: Memo) -> None:
        self._store = store
        self._version = package_version("pygments")

    def __call__(self, language: str, code: str) -> tuple[Markup, ...]:
        key = step_key("code", self._version, language, code)
        found = self._store.get_value(_CODE, key, list[str], local=True)
        if found is not None:
            return tuple(map(Markup, found))
        lines = mark_now(language, code)
        self._store.put_value(_CODE, key, list(map(str, lines)), local=True)
        return lines
