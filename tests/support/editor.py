"""An editor with a language server of its own: pygls' client, over pipes."""

from __future__ import annotations

import asyncio
import sys
import threading
import time
from collections.abc import Callable, Coroutine
from typing import Any, TypeVar

from lsprotocol import types
from pygls.lsp.client import LanguageClient

from coursebuild.core.text.source import Source
from coursebuild.features.language_server.commands.places import Places
from support.scratch_course import Folder

T = TypeVar("T")


class Editor:
    """What it shows of a course; places are given as text in which `|` is the cursor."""

    def __init__(self, folder: Folder) -> None:
        self.folder = folder
        self.places = Places(folder.root)
        self.texts: dict[str, str] = {}
        """Of the files that are open, by path."""
        self.diagnostics: dict[str, list[types.Diagnostic]] = {}
        self._news = threading.Condition()
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever)
        self._thread.start()
        self.client = LanguageClient("editor", "1")
        self.client.feature(types.TEXT_DOCUMENT_PUBLISH_DIAGNOSTICS)(lambda told: self._hear(told))
        command = [sys.executable, "-m", "coursebuild", "lsp"]
        self.ask(self.client.start_io(*command, cwd=folder.root, env=folder.environment()))
        asked = types.InitializeParams(types.ClientCapabilities(), root_uri=folder.root.as_uri())
        self.ask(self.client.initialize_async(asked))
        self.client.initialized(types.InitializedParams())

    def ask(self, answer: Coroutine[Any, Any, T]) -> T:
        return asyncio.run_coroutine_threadsafe(answer, self._loop).result(300)

    def close(self) -> int | None:
        """Go without a word, as an editor that crashes; the status of the server."""
        server = self.client._server
        assert server is not None and server.stdin is not None
        self._loop.call_soon_threadsafe(server.stdin.close)
        self.ask(self.client.stop())
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()
        return server.returncode

    # --- texts

    def write(self, path: str, text: str) -> None:
        """Have a text in the editor, which is not saved."""
        uri = self.places.uri(path)
        if path not in self.texts:
            item = types.TextDocumentItem(uri, "markdown", 1, text)
            self._do(self.client.text_document_did_open, types.DidOpenTextDocumentParams(item))
        else:
            changed = types.VersionedTextDocumentIdentifier(2, uri)
            whole = types.TextDocumentContentChangeWholeDocument(text)
            params = types.DidChangeTextDocumentParams(changed, [whole])
            self._do(self.client.text_document_did_change, params)
        self.texts[path] = text

    def save(self, path: str) -> None:
        self.folder.write(path, self.texts[path])

    def leave(self, path: str) -> None:
        """Close a file, without saving it."""
        params = types.DidCloseTextDocumentParams(self.identifier(path))
        self._do(self.client.text_document_did_close, params)
        del self.texts[path]

    def _do(self, notify: Callable[[Any], None], params: object) -> None:
        async def now() -> None:
            notify(params)

        self.ask(now())

    # --- what is asked

    def identifier(self, path: str) -> types.TextDocumentIdentifier:
        return types.TextDocumentIdentifier(self.places.uri(path))

    def place(self, path: str, needle: str) -> types.Position:
        text, at = self.texts[path], needle.index("|")
        found = text.rfind(needle.replace("|", "", 1))
        assert found >= 0, f"{needle!r} is not in the text"
        return self.places.position(Source(path, text), found + at)

    def request(self, method: str, params: object) -> Any:
        return self.ask(getattr(self.client, f"text_document_{method}_async")(params))

    def hover_text(self, path: str, needle: str) -> str:
        where = types.HoverParams(self.identifier(path), self.place(path, needle))
        found = self.request("hover", where)
        return "" if found is None else found.contents.value

    def definition(self, path: str, needle: str) -> str:
        """Path and line of a definition."""
        where = types.DefinitionParams(self.identifier(path), self.place(path, needle))
        found = self.request("definition", where)
        if found is None:
            return ""
        return f"{self.places.path(found.uri)}:{found.range.start.line + 1}"

    def proposals(self, path: str, needle: str) -> dict[str, types.CompletionItem]:
        where = types.CompletionParams(self.identifier(path), self.place(path, needle))
        return {i.label: i for i in self.request("completion", where)}

    def actions(self, path: str, needle: str) -> dict[str, types.CodeAction]:
        place = self.place(path, needle)
        context = types.CodeActionContext([])
        where = types.CodeActionParams(self.identifier(path), types.Range(place, place), context)
        return {a.title: a for a in self.request("code_action", where)}

    def apply_edits(self, edits: dict[str, list[types.TextEdit]]) -> dict[str, str]:
        """The texts of files after edits, by path."""
        done = {}
        for uri, its in edits.items():
            path = self.places.path(uri)
            text = self.texts.get(path) or self.folder.text(path)
            source = Source(path, text)
            for edit in sorted(its, key=lambda e: (-e.range.start.line, -e.range.start.character)):
                start = self.places.offset(source, edit.range.start)
                end = self.places.offset(source, edit.range.end)
                text = text[:start] + edit.new_text + text[end:]
            done[path] = text
        return done

    # --- what is told

    def _hear(self, told: types.PublishDiagnosticsParams) -> None:
        with self._news:
            self.diagnostics[self.places.path(told.uri)] = list(told.diagnostics)
            self._news.notify_all()

    def until(self, path: str, *rules: str, line: int | None = None) -> list[types.Diagnostic]:
        """The diagnostics of a file, once they are of these rules, the first at this line."""

        def good() -> bool:
            told = self.diagnostics.get(path, [])
            return [one.code for one in told] == [*rules] and (
                line is None or told[0].range.start.line == line
            )

        with self._news:
            assert self._news.wait_for(good, 120), self.diagnostics
            return self.diagnostics.get(path, [])

    def wait_for(self, answer: Callable[[], T]) -> T:
        """An answer, asked for until it is something."""
        until = time.monotonic() + 120
        while not (found := answer()):
            assert time.monotonic() < until, self.diagnostics
        return found
