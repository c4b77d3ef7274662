"""What a client of the language server may ask, and what it is told.

Entry point: `Server`. Answers are for the texts as they are in the editor, of which it sends the
whole at each change: changes of parts would go by other line ends than a course's.
"""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable
from functools import partial
from typing import Any

from lsprotocol import types
from pygls.lsp.server import LanguageServer

from coursebuild import __version__
from coursebuild.core.engine.memo import Memo
from coursebuild.core.text.source import Source
from coursebuild.features.language_server.commands.actions import actions
from coursebuild.features.language_server.commands.completion import completions
from coursebuild.features.language_server.commands.diagnosis import diagnoses, published
from coursebuild.features.language_server.commands.lookup import definition, hover
from coursebuild.features.language_server.commands.outline import folds, headings, layout
from coursebuild.features.language_server.commands.places import Places
from coursebuild.features.language_server.commands.renaming import name_at, rename
from coursebuild.features.language_server.commands.texts import OpenTexts
from coursebuild.preview.session import Session

_TEXTS: dict[str, Callable[[Any], str | None]] = {
    types.TEXT_DOCUMENT_DID_OPEN: lambda asked: asked.text_document.text,
    types.TEXT_DOCUMENT_DID_CHANGE: lambda asked: asked.content_changes[-1].text,
    types.TEXT_DOCUMENT_DID_CLOSE: lambda asked: None,
}
_ANSWERS: dict[str, Callable[[OpenTexts, Source, Any], Any]] = {
    types.TEXT_DOCUMENT_HOVER: hover,
    types.TEXT_DOCUMENT_DEFINITION: definition,
    types.TEXT_DOCUMENT_COMPLETION: completions,
    types.TEXT_DOCUMENT_CODE_ACTION: actions,
    types.TEXT_DOCUMENT_FORMATTING: layout,
    types.TEXT_DOCUMENT_PREPARE_RENAME: name_at,
    types.TEXT_DOCUMENT_RENAME: rename,
    types.TEXT_DOCUMENT_DOCUMENT_SYMBOL: headings,
    types.TEXT_DOCUMENT_FOLDING_RANGE: folds,
}
_OPTIONS: dict[str, object] = {
    types.TEXT_DOCUMENT_COMPLETION: types.CompletionOptions(trigger_characters=[*':.#!"/(`=']),
    types.TEXT_DOCUMENT_RENAME: types.RenameOptions(prepare_provider=True),
}


class Server:
    """See the module."""

    def __init__(self, session: Session, store: Memo) -> None:
        self.session, self.store, self.places = session, store, Places(session.root)
        self.client = LanguageServer(
            "coursebuild", __version__, types.TextDocumentSyncKind.Full, max_workers=1
        )
        self._typed: set[str] = set()
        """Paths of texts that were not read since they were typed."""
        self._typing = threading.Condition()
        self._loop: asyncio.AbstractEventLoop | None = None
        """Of the thread that answers, from when the client is ready."""
        feature = self.client.feature
        feature(types.INITIALIZED)(lambda asked: self._begin())
        for method, text in _TEXTS.items():
            feature(method)(partial(self._take, text))
        for method, answer in _ANSWERS.items():
            feature(method, _OPTIONS.get(method))(partial(self._answer, answer))

    def _answer(self, answer: Callable[[OpenTexts, Source, Any], Any], asked: Any) -> Any:
        """Answer about a text, as long as anything is known of the course."""
        library = self.session.library
        if library is None:
            return None
        texts = OpenTexts(self.session, library, self.places, self.store)
        return answer(texts, texts.source(self.places.path(asked.text_document.uri)), asked)

    def _begin(self) -> None:
        """Tell the client what is wrong from now on."""
        encoding = self.client.workspace.position_encoding or "utf-16"
        self.places.encoding = types.PositionEncodingKind(encoding).value
        self._loop = asyncio.get_running_loop()
        self.session.tell()

    # --- what is typed

    def _take(self, text_of: Callable[[Any], str | None], asked: Any) -> None:
        """Take a text of the editor, or that its file is open no longer."""
        text, session = text_of(asked), self.session
        path = self.places.path(asked.text_document.uri)
        if not path.startswith(("content/", "models/")) and path not in session.files_elsewhere():
            return
        texts = {other: known for other, known in session.open_texts.items() if other != path}
        if text is not None:  # half a character, which no file can hold, is none
            texts[path] = text.encode("utf-16", "surrogatepass").decode("utf-16", "replace")
        session.open_texts = texts
        with self._typing:
            self._typed.add(path)
            self._typing.notify()

    def take_typing(self) -> None:
        """Read what was typed, as long as the process lives."""
        while True:
            with self._typing:
                self._typing.wait_for(lambda: self._typed)
                paths, self._typed = self._typed, set()
            self.session.calm.clear()
            try:
                if self.session.edit(paths, saved=False) is None:
                    self.session.read(saved=False)
            finally:
                self.session.calm.set()

    # --- what is wrong

    def publish(self) -> None:
        """Tell the client what is wrong, file by file, as long as the process lives."""
        session, seen = self.session, -1
        told: dict[str, list[types.Diagnostic]] = {}
        while True:
            with session.changed:
                while self._loop is None or session.version == seen:
                    session.changed.wait()
                seen = session.version
            found: dict[str, list[types.Diagnostic]] = {uri: [] for uri in told}
            for one in diagnoses(session):
                uri = self.places.uri(one.span.path)
                found.setdefault(uri, []).append(published(one, self.places))
            for uri, diagnostics in found.items():
                if diagnostics != told.get(uri):
                    params = types.PublishDiagnosticsParams(uri, diagnostics)
                    self._loop.call_soon_threadsafe(
                        self.client.text_document_publish_diagnostics, params
                    )
            told = {uri: diagnostics for uri, diagnostics in found.items() if diagnostics}
