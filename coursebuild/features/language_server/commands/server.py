"""The requests of a client of the language server, and the diagnostics sent to it.

Answers are about the texts as they are in the editor, which sends the whole text at each change:
partial changes would count other line ends than a course has.

To open a folder runs nothing that lies in it. Scripts and features run from the first save on.
"""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any

from lsprotocol import types
from pygls.lsp.server import LanguageServer

from coursebuild import __version__
from coursebuild.api import Document, Lesson, Source, Span, document_blocks
from coursebuild.core.model import Heading, Paragraph, plain_text
from coursebuild.features.authoring.format import format_document
from coursebuild.features.language_server.commands.diagnosis import (
    actions,
    current_diagnostics,
    to_lsp,
)
from coursebuild.features.language_server.commands.lookup import definition, hover
from coursebuild.features.language_server.commands.proposals import completions, name_at, rename
from coursebuild.features.language_server.commands.texts import OpenTexts, Places
from coursebuild.preview.session import Session


def headings(
    texts: OpenTexts, source: Source, params: types.DocumentSymbolParams
) -> list[types.DocumentSymbol]:
    """Return the headings as a tree."""
    places, document = texts.places, texts.document(source)
    roots: list[types.DocumentSymbol] = []
    open_levels: list[tuple[int, list[types.DocumentSymbol]]] = [(0, roots)]
    for heading, section in _sections(document) if document else ():
        while open_levels[-1][0] >= heading.level:
            open_levels.pop()
        children: list[types.DocumentSymbol] = []
        symbol = types.DocumentSymbol(
            " ".join(plain_text(heading.children).split()) or "…",  # clients refuse an empty name
            types.SymbolKind.String,
            places.range(section),
            places.range(heading.span),
            children=children,
        )
        open_levels[-1][1].append(symbol)
        open_levels.append((heading.level, children))
    return roots


def _sections(document: Document) -> Iterator[tuple[Heading, Span]]:
    """Yield each heading with the span of its section."""
    headings = [block for block in document.blocks if isinstance(block, Heading)]
    for index, heading in enumerate(headings, 1):
        ends = (later.span.start for later in headings[index:] if later.level <= heading.level)
        end = next(ends, len(document.source.text))
        yield heading, document.source.span(heading.span.start, end)


def folds(
    texts: OpenTexts, source: Source, params: types.FoldingRangeParams
) -> list[types.FoldingRange]:
    """Return the sections, and all blocks of several lines except paragraphs."""
    document = texts.document(source)
    if document is None:
        return []
    blocks = (block for block in document_blocks(document) if not isinstance(block, Paragraph))
    spans = [*(b.span for b in blocks), *(section for _, section in _sections(document))]
    lines = ((span.line - 1, span.line + span.text.rstrip().count("\n") - 1) for span in spans)
    return [types.FoldingRange(first, last) for first, last in lines if first < last]


def format_text(
    texts: OpenTexts, source: Source, params: types.DocumentFormattingParams
) -> list[types.TextEdit]:
    """Return the edits that `coursebuild fmt` would make."""
    owner, course = texts.owner(source), texts.library.course
    if owner is None:
        return []
    lesson, width, words = isinstance(owner, Lesson), course.width, course.words_of(owner)
    new = format_document(
        source, course.callout_names, lesson=lesson, width=width, words=words
    ).value
    edit = types.TextEdit(texts.places.range(source.span()), new)
    return [] if new == source.text else [edit]


_TEXTS: dict[str, Callable[[Any], Sequence[str | None]]] = {
    types.TEXT_DOCUMENT_DID_OPEN: lambda params: [params.text_document.text],
    types.TEXT_DOCUMENT_DID_CHANGE: lambda params: [c.text for c in params.content_changes],
    types.TEXT_DOCUMENT_DID_CLOSE: lambda params: [None],
}
"""The texts that a file has one after the other; `None`: it is closed."""
_ANSWERS: dict[str, Callable[[OpenTexts, Source, Any], Any]] = {
    types.TEXT_DOCUMENT_HOVER: hover,
    types.TEXT_DOCUMENT_DEFINITION: definition,
    types.TEXT_DOCUMENT_COMPLETION: completions,
    types.TEXT_DOCUMENT_CODE_ACTION: actions,
    types.TEXT_DOCUMENT_FORMATTING: format_text,
    types.TEXT_DOCUMENT_PREPARE_RENAME: name_at,
    types.TEXT_DOCUMENT_RENAME: rename,
    types.TEXT_DOCUMENT_DOCUMENT_SYMBOL: headings,
    types.TEXT_DOCUMENT_FOLDING_RANGE: folds,
}
_OPTIONS: dict[str, object] = {
    types.TEXT_DOCUMENT_CODE_ACTION: types.CodeActionOptions(
        [
            types.CodeActionKind.QuickFix,
            types.CodeActionKind.RefactorRewrite,
            types.CodeActionKind.SourceFixAll,
        ]
    ),
    types.TEXT_DOCUMENT_COMPLETION: types.CompletionOptions(trigger_characters=[*':.#!"/(`=@']),
    types.TEXT_DOCUMENT_RENAME: types.RenameOptions(prepare_provider=True),
}


class Server:
    """Answers a client, and sends it the diagnostics of its course."""

    def __init__(self, session: Session) -> None:
        self.session, self.places = session, Places(session.root)
        self.client = LanguageServer(
            "coursebuild", __version__, types.TextDocumentSyncKind.Full, max_workers=1
        )
        self._edited_paths: set[str] = set()
        """Paths of texts that were edited and not read since."""
        self._edited = threading.Condition()
        session.code = "known"
        self._loop: asyncio.AbstractEventLoop | None = None
        """The loop of the thread that answers; `None` until the client is ready."""
        feature = self.client.feature
        feature(types.INITIALIZED)(lambda params: self._begin())
        for method, get_texts in _TEXTS.items():
            feature(method)(partial(self._take_text, get_texts))
        feature(types.TEXT_DOCUMENT_DID_SAVE)(lambda params: session.run_code())
        for method, answer in _ANSWERS.items():
            feature(method, _OPTIONS.get(method))(partial(self._answer, answer))

    def _answer(self, answer: Callable[[OpenTexts, Source, Any], Any], params: Any) -> Any:
        """Answer a request about a text; `None` where the course has never been readable."""
        library = self.session.library
        if library is None:
            return None
        texts = OpenTexts(self.session, library, self.places)
        return answer(texts, texts.source(self.places.path(params.text_document.uri)), params)

    def _begin(self) -> None:
        encoding = self.client.workspace.position_encoding or "utf-16"
        self.places.encoding = types.PositionEncodingKind(encoding).value
        self._loop = asyncio.get_running_loop()
        self.session.notify()

    # --- edits

    def _take_text(self, get_texts: Callable[[Any], Sequence[str | None]], params: Any) -> None:
        texts, session = get_texts(params), self.session
        path = self.places.path(params.text_document.uri)
        if not path.startswith(("content/", "models/")) and path not in session.files_elsewhere():
            return
        if not texts:  # a change may be none
            return
        text = texts[-1]
        open_texts = {p: open_text for p, open_text in session.open_texts.items() if p != path}
        if text is not None:  # without half characters, which no file can hold
            open_texts[path] = text.encode("utf-16", "surrogatepass").decode("utf-16", "replace")
        session.open_texts = open_texts
        with self._edited:
            self._edited_paths.add(path)
            self._edited.notify()

    def read_edits(self) -> None:
        """Read edited texts, as long as the process lives."""
        while True:
            with self._edited:
                self._edited.wait_for(lambda: self._edited_paths)
                paths, self._edited_paths = self._edited_paths, set()
            self.session.calm.clear()
            try:
                if self.session.edit(paths, is_saved=False) is None:
                    self.session.read(is_saved=False)
            finally:
                self.session.calm.set()

    # --- diagnostics

    def publish(self) -> None:
        """Send each file's diagnostics when they change, as long as the process lives."""
        session, version = self.session, -1
        last_sent: dict[str, list[types.Diagnostic]] = {}
        while True:
            with session.condition:
                while self._loop is None or session.version == version:
                    session.condition.wait()
                version = session.version
            by_uri: dict[str, list[types.Diagnostic]] = {uri: [] for uri in last_sent}
            for diagnostic in current_diagnostics(session):
                uri = self.places.uri(diagnostic.span.path)
                by_uri.setdefault(uri, []).append(to_lsp(diagnostic, self.places))
            for uri, diagnostics in by_uri.items():
                if diagnostics != last_sent.get(uri):
                    params = types.PublishDiagnosticsParams(uri, diagnostics)
                    self._loop.call_soon_threadsafe(
                        self.client.text_document_publish_diagnostics, params
                    )
            last_sent = {uri: diagnostics for uri, diagnostics in by_uri.items() if diagnostics}
