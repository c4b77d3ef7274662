"""What a client of the language server may ask, and what it is told.

Entry point: `Server`. Answers are for the texts as they are in the editor, of which it sends the
whole at each change: changes of parts would go by other line ends than a course's.
"""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Iterable

from lsprotocol import types
from pygls.exceptions import JsonRpcInvalidParams
from pygls.lsp.server import LanguageServer

from coursebuild import __version__
from coursebuild.core.engine.memo import Memo
from coursebuild.core.files.errors import UsageError
from coursebuild.core.text.diagnostics import Edit
from coursebuild.core.text.source import Source
from coursebuild.features.language_server.commands.actions import actions
from coursebuild.features.language_server.commands.completion import completions
from coursebuild.features.language_server.commands.diagnosis import diagnoses, published
from coursebuild.features.language_server.commands.lookup import look_up
from coursebuild.features.language_server.commands.outline import folds, headings
from coursebuild.features.language_server.commands.places import Places
from coursebuild.features.language_server.commands.renaming import named_lesson, renamed
from coursebuild.features.language_server.commands.texts import OpenTexts
from coursebuild.preview.session import Session


class Server:
    """See the module."""

    def __init__(self, session: Session, store: Memo) -> None:
        self.session = session
        self.texts = OpenTexts(session, store)
        self.places = Places(session.root)
        self.client = LanguageServer(
            "coursebuild", __version__, types.TextDocumentSyncKind.Full, max_workers=1
        )
        self._typed: set[str] = set()
        """Paths of texts that were not read since they were typed."""
        self._typing = threading.Condition()
        self._loop: asyncio.AbstractEventLoop | None = None
        """Of the thread that answers, from when the client is ready."""
        self._register()

    def _register(self) -> None:
        feature = self.client.feature

        @feature(types.INITIALIZED)
        def initialized(params: types.InitializedParams) -> None:
            encoding = self.client.workspace.position_encoding or "utf-16"
            self.places.encoding = types.PositionEncodingKind(encoding).value
            self._loop = asyncio.get_running_loop()
            self.session.tell()

        @feature(types.TEXT_DOCUMENT_DID_OPEN)
        def opened(params: types.DidOpenTextDocumentParams) -> None:
            self._take(params.text_document.uri, params.text_document.text)

        @feature(types.TEXT_DOCUMENT_DID_CHANGE)
        def changed(params: types.DidChangeTextDocumentParams) -> None:
            self._take(params.text_document.uri, params.content_changes[-1].text)

        @feature(types.TEXT_DOCUMENT_DID_CLOSE)
        def closed(params: types.DidCloseTextDocumentParams) -> None:
            self._take(params.text_document.uri, None)

        @feature(types.TEXT_DOCUMENT_HOVER)
        def hover(params: types.HoverParams) -> types.Hover | None:
            found = look_up(self.texts, *self._place(params.text_document, params.position))
            if found is None:
                return None
            text = types.MarkupContent(types.MarkupKind.Markdown, found.text)
            return types.Hover(text, self.places.range(found.span))

        @feature(types.TEXT_DOCUMENT_DEFINITION)
        def definition(params: types.DefinitionParams) -> types.Location | None:
            found = look_up(self.texts, *self._place(params.text_document, params.position))
            place = None if found is None else found.place
            return None if place is None else self.places.location(place)

        self._register_edits()

    def _register_edits(self) -> None:
        feature = self.client.feature

        @feature(
            types.TEXT_DOCUMENT_COMPLETION,
            types.CompletionOptions(trigger_characters=[*':.#!"/(`=']),
        )
        def completion(params: types.CompletionParams) -> list[types.CompletionItem]:
            place = self._place(params.text_document, params.position)
            span, proposals = completions(self.texts, *place)
            there = self.places.range(span)
            return [
                types.CompletionItem(
                    one.text.strip('"'),
                    kind=one.kind,
                    detail=one.detail,
                    filter_text=one.text,
                    text_edit=types.TextEdit(there, one.text),
                )
                for one in proposals
            ]

        @feature(types.TEXT_DOCUMENT_CODE_ACTION)
        def code_action(params: types.CodeActionParams) -> list[types.CodeAction]:
            source, start = self._place(params.text_document, params.range.start)
            end = self.places.offset(source, params.range.end)
            kinds = types.CodeActionKind
            return [
                types.CodeAction(
                    one.title,
                    kinds.QuickFix if one.mends else kinds.RefactorRewrite,
                    [published(diagnostic, self.places) for diagnostic in one.mends],
                    edit=self._edit(one.edits),
                )
                for one in actions(self.texts, source.span(start, end))
            ]

        @feature(types.TEXT_DOCUMENT_FORMATTING)
        def formatting(params: types.DocumentFormattingParams) -> list[types.TextEdit]:
            source = self._source(params.text_document)
            new = self.texts.formatted(source)
            whole = self.places.range(source.span())
            return [] if new in (None, source.text) else [types.TextEdit(whole, new or "")]

        @feature(types.TEXT_DOCUMENT_PREPARE_RENAME)
        def prepare_rename(params: types.PrepareRenameParams) -> types.Range | None:
            found = named_lesson(self.texts, *self._place(params.text_document, params.position))
            return None if found is None else self.places.range(found[1])

        @feature(types.TEXT_DOCUMENT_RENAME, types.RenameOptions(prepare_provider=True))
        def rename(params: types.RenameParams) -> types.WorkspaceEdit | None:
            found = named_lesson(self.texts, *self._place(params.text_document, params.position))
            if found is None or self.texts.library is None:
                return None
            try:
                edits, moved = renamed(self.texts.library, found[0], params.new_name)
            except UsageError as error:
                raise JsonRpcInvalidParams(str(error)) from None
            return self._edit(edits, moved)

        @feature(types.TEXT_DOCUMENT_DOCUMENT_SYMBOL)
        def symbols(params: types.DocumentSymbolParams) -> list[types.DocumentSymbol]:
            document = self.texts.document(self._source(params.text_document))
            return [] if document is None else headings(document, self.places)

        @feature(types.TEXT_DOCUMENT_FOLDING_RANGE)
        def folding(params: types.FoldingRangeParams) -> list[types.FoldingRange]:
            document = self.texts.document(self._source(params.text_document))
            return [] if document is None else folds(document)

    def _edit(
        self, edits: Iterable[Edit], moved: tuple[str, str] | None = None
    ) -> types.WorkspaceEdit:
        """Edits for the client to make, and then a file to rename."""
        by_path: dict[str, list[Edit]] = {}
        for edit in edits:
            by_path.setdefault(edit.span.path, []).append(edit)
        changes = {
            self.places.uri(path): [types.TextEdit(self.places.range(e.span), e.text) for e in its]
            for path, its in by_path.items()
        }
        if moved is None:
            return types.WorkspaceEdit(changes)
        named = types.OptionalVersionedTextDocumentIdentifier
        files = [types.TextDocumentEdit(named(uri), its) for uri, its in changes.items()]
        old, new = map(self.places.uri, moved)
        return types.WorkspaceEdit(document_changes=[*files, types.RenameFile(old, new)])

    def _source(self, document: types.TextDocumentIdentifier) -> Source:
        """The text of which something is asked; one of nothing where it is none of the course."""
        return self.texts.source(self.places.path(document.uri)) or Source("", "")

    def _place(
        self, document: types.TextDocumentIdentifier, position: types.Position
    ) -> tuple[Source, int]:
        source = self._source(document)
        return source, self.places.offset(source, position)

    # --- what is typed

    def _take(self, uri: str, text: str | None) -> None:
        """Take a text of the editor; `None`: the file is open no longer."""
        path, session = self.places.path(uri), self.session
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
                    self._tell(types.PublishDiagnosticsParams(uri, diagnostics))
            told = {uri: diagnostics for uri, diagnostics in found.items() if diagnostics}

    def _tell(self, params: types.PublishDiagnosticsParams) -> None:
        assert self._loop is not None
        self._loop.call_soon_threadsafe(self.client.text_document_publish_diagnostics, params)
