"""An editor with a language server of its own: pygls' client, over pipes."""

from __future__ import annotations

import asyncio
import sys
import threading
import time
from collections.abc import Callable, Coroutine, Sequence
from typing import Any, TypeVar

from lsprotocol import types
from pygls.lsp.client import LanguageClient

from coursebuild.core.text.source import Source
from coursebuild.features.language_server.commands.texts import Places
from support.scratch_course import Folder

T = TypeVar("T")


class Editor:
    """An editor of a course. Places are given as text in which `|` is the cursor."""

    def __init__(self, folder: Folder, command: Sequence[str] = (), **variables: str) -> None:
        """`command` starts the server, with these variables; by default, this tree's."""
        self.folder = folder
        self.places = Places(folder.root)
        self.texts: dict[str, str] = {}
        """The open files, by path."""
        self.diagnostics: dict[str, list[types.Diagnostic]] = {}
        self._news = threading.Condition()
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever)
        self._thread.start()
        self.client = LanguageClient("editor", "1")
        self.client.feature(types.TEXT_DOCUMENT_PUBLISH_DIAGNOSTICS)(
            lambda params: self._hear(params)
        )
        command = command or (sys.executable, "-m", "coursebuild", "lsp")
        environment = folder.environment(variables)
        self.ask(self.client.start_io(*command, cwd=folder.root, env=environment))
        params = types.InitializeParams(types.ClientCapabilities(), root_uri=folder.root.as_uri())
        self.ask(self.client.initialize_async(params))
        self.client.initialized(types.InitializedParams())

    def ask(self, answer: Coroutine[Any, Any, T]) -> T:
        return asyncio.run_coroutine_threadsafe(answer, self._loop).result(300)

    def close(self) -> int | None:
        """Close the pipe like an editor that crashes; returns the status of the server."""
        server = self.client._server
        assert server is not None and server.stdin is not None
        self._loop.call_soon_threadsafe(server.stdin.close)
        self.ask(self._wait_for_end())
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()
        return server.returncode

    async def _wait_for_end(self) -> None:
        """Read all that the server says until it ends: it may not wait for that."""
        server = self.client._server
        assert server is not None and server.stderr is not None
        await asyncio.gather(server.wait(), server.stderr.read())
        await self.client.stop()

    # --- texts

    def write(self, path: str, text: str) -> None:
        """Put a text into the editor, without saving it."""
        uri = self.places.uri(path)
        if path not in self.texts:
            item = types.TextDocumentItem(uri, "markdown", 1, text)
            self._do(self.client.text_document_did_open, types.DidOpenTextDocumentParams(item))
        else:
            document = types.VersionedTextDocumentIdentifier(2, uri)
            whole = types.TextDocumentContentChangeWholeDocument(text)
            params = types.DidChangeTextDocumentParams(document, [whole])
            self._do(self.client.text_document_did_change, params)
        self.texts[path] = text

    def save(self, path: str) -> None:
        self.folder.write(path, self.texts[path])
        params = types.DidSaveTextDocumentParams(self.identifier(path))
        self._do(self.client.text_document_did_save, params)

    def leave(self, path: str) -> None:
        params = types.DidCloseTextDocumentParams(self.identifier(path))
        self._do(self.client.text_document_did_close, params)
        del self.texts[path]

    def _do(self, notify: Callable[[Any], None], params: object) -> None:
        async def now() -> None:
            notify(params)

        self.ask(now())

    # --- requests

    def identifier(self, path: str) -> types.TextDocumentIdentifier:
        return types.TextDocumentIdentifier(self.places.uri(path))

    def place(self, path: str, needle: str) -> types.Position:
        text, at = self.texts[path], needle.index("|")
        start = text.rfind(needle.replace("|", "", 1))
        assert start >= 0, f"{needle!r} is not in the text"
        return self.places.position(Source(path, text), start + at)

    def request(self, method: str, params: object) -> Any:
        return self.ask(getattr(self.client, f"text_document_{method}_async")(params))

    def hover_text(self, path: str, needle: str) -> str:
        params = types.HoverParams(self.identifier(path), self.place(path, needle))
        hover = self.request("hover", params)
        return "" if hover is None else hover.contents.value

    def definition(self, path: str, needle: str) -> str:
        """Return the path and line of a definition."""
        params = types.DefinitionParams(self.identifier(path), self.place(path, needle))
        location = self.request("definition", params)
        if location is None:
            return ""
        return f"{self.places.path(location.uri)}:{location.range.start.line + 1}"

    def proposals(self, path: str, needle: str) -> dict[str, types.CompletionItem]:
        params = types.CompletionParams(self.identifier(path), self.place(path, needle))
        return {i.label: i for i in self.request("completion", params)}

    def actions(
        self, path: str, needle: str, only: list[types.CodeActionKind] | None = None
    ) -> dict[str, types.CodeAction]:
        place = self.place(path, needle)
        context = types.CodeActionContext([], only)
        params = types.CodeActionParams(self.identifier(path), types.Range(place, place), context)
        return {a.title: a for a in self.request("code_action", params)}

    def apply_edits(self, edits: dict[str, list[types.TextEdit]]) -> dict[str, str]:
        texts = {}
        for uri, file_edits in edits.items():
            path = self.places.path(uri)
            is_new = not (self.folder.root / path).exists()  # the client was told to make it
            text = self.texts.get(path) or ("" if is_new else self.folder.text(path))
            source = Source(path, text)
            for edit in sorted(
                file_edits, key=lambda e: (-e.range.start.line, -e.range.start.character)
            ):
                start = self.places.offset(source, edit.range.start)
                end = self.places.offset(source, edit.range.end)
                text = text[:start] + edit.new_text + text[end:]
            texts[path] = text
        return texts

    # --- diagnostics

    def _hear(self, params: types.PublishDiagnosticsParams) -> None:
        with self._news:
            self.diagnostics[self.places.path(params.uri)] = list(params.diagnostics)
            self._news.notify_all()

    def until(self, path: str, *rules: str, line: int | None = None) -> list[types.Diagnostic]:
        """Wait until a file has diagnostics of these rules, the first at this line; return them."""

        def matches() -> bool:
            diagnostics = self.diagnostics.get(path, [])
            return [diagnostic.code for diagnostic in diagnostics] == [*rules] and (
                line is None or diagnostics[0].range.start.line == line
            )

        with self._news:
            assert self._news.wait_for(matches, 120), self.diagnostics
            return self.diagnostics.get(path, [])

    def wait_for(self, answer: Callable[[], T]) -> T:
        until = time.monotonic() + 120
        while not (result := answer()):
            assert time.monotonic() < until, self.diagnostics
        return result
