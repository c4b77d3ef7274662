"""A preview in its own process: HTTP requests to it, and its event stream."""

from __future__ import annotations

import contextlib
import http.client
import json
import socket
import subprocess
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any
from urllib.parse import urlsplit

from coursebuild.preview.server import PREFIX
from support.fixture_cases import fixture_text
from support.scratch_course import Folder, kill_at_end, wait_until_alone

PATIENT = fixture_text("scripts/patient.txt")
"""The command with longer waits for the rest of a save, so that it arrives in time on any machine.

The usual waits suit a program that saves within a few milliseconds on an idle machine.
"""


class Preview:
    def __init__(self, folder: Folder, process: subprocess.Popen[bytes]) -> None:
        self.folder = folder
        self.process = process
        self.lines: list[str] = []
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        first = self.wait_for_line("serving http://127.0.0.1:")
        self.link = first.split()[1]
        parts = urlsplit(self.link)
        assert parts.port is not None
        self.port, self.token = parts.port, parts.query.removeprefix("token=")
        self.cookie = f"coursebuild-{self.port}={self.token}"

    def _read(self) -> None:
        assert self.process.stderr is not None
        with contextlib.suppress(ValueError):  # closed at the end of the test
            for line in self.process.stderr:
                self.lines.append(line.decode().rstrip("\n"))

    def wait_for_line(self, text: str, after: int = 0, seconds: float = 300.0) -> str:
        """Wait for a line of the process's output that contains a text; returns it."""
        until = time.monotonic() + seconds
        while True:
            for line in self.lines[after:]:
                if text in line:
                    return line
            assert time.monotonic() < until, f"{text!r} is not in {self.lines}"
            assert self.process.poll() is None, self.lines
            time.sleep(0.02)

    def check_interrupted(self) -> None:
        """Check that the process ends as interrupted, without a traceback."""
        assert self.process.wait(600) == 130
        self._reader.join(600)
        assert self.lines[-1] == "interrupted"
        assert "Traceback" not in "\n".join(self.lines)

    def get(
        self, path: str, method: str = "GET", body: bytes = b"", **headers: str
    ) -> tuple[int, dict[str, str], bytes]:
        """The answer to a request, which shows the token unless another `Cookie` is given."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=120)
        with contextlib.closing(connection):
            connection.putrequest(method, path, skip_host="Host" in headers)
            for name, value in {"Cookie": self.cookie, **headers}.items():
                connection.putheader(name.replace("_", "-"), value)
            if body:
                connection.putheader("Content-Length", str(len(body)))
            connection.endheaders(body or None)
            response = connection.getresponse()
            return response.status, dict(response.getheaders()), response.read()

    def exchange(self, request: bytes) -> bytes:
        address = ("127.0.0.1", self.port)
        with socket.create_connection(address, timeout=120) as link, contextlib.suppress(OSError):
            answer = b""
            request = request.replace(b"COOKIE", self.cookie.encode())
            link.sendall(request.replace(b"PORT", str(self.port).encode()))
            while data := link.recv(1 << 16):
                answer += data
        return answer

    def accept(self, body: bytes, **headers: str) -> tuple[int, Any]:
        """The server's answer to an acceptance: its status, and its body as JSON or text."""
        status, _, data = self.get(f"{PREFIX}accept", "POST", body, **headers)
        return status, json.loads(data) if data.startswith(b"{") else data.decode()

    def accept_offer(self, id: str) -> tuple[int, Any]:
        """The server's answer when the first lesson's page accepts an offer."""
        body = json.dumps({"page": "lessons/1.1-one.html", "id": id}).encode()
        return self.accept(body, Origin=f"http://127.0.0.1:{self.port}")

    @contextlib.contextmanager
    def events(self, page: str = "lessons/1.1-one.html") -> Iterator[Events]:
        with socket.create_connection(("127.0.0.1", self.port), timeout=120) as link:
            head = f"Host: 127.0.0.1:{self.port}\r\nCookie: {self.cookie}\r\n\r\n"
            link.sendall(f"GET {PREFIX}events?page={page} HTTP/1.1\r\n{head}".encode())
            with link.makefile("rb") as stream:
                answer = b""
                while not answer.endswith(b"\r\n\r\n"):
                    answer += stream.readline()
                assert answer.startswith(b"HTTP/1.1 200 ")
                assert b"text/event-stream" in answer
                yield Events(_events(stream))


class Events:
    """The event stream of one page, and the last event of each kind."""

    def __init__(self, stream: Iterator[tuple[str, str]]) -> None:
        self.stream = stream
        self.hello: dict[str, Any] = {}
        self.state = ""
        self.pages = 0
        self.news: dict[str, Any] = {}

    def until(self, good: Callable[[Events], bool]) -> Events:
        while not (self.hello and self.news and good(self)):
            name, data = next(self.stream, ("", ""))
            assert name, f"nothing came after {self.state} {self.news}"
            match name:
                case "hello":
                    self.hello = json.loads(data)
                case "page":
                    self.state = json.loads(data)
                    self.pages += 1
                    self.news = {}  # it follows
                case "news":
                    self.news = json.loads(data)
                case _:
                    raise AssertionError(name)
        return self

    def offered(self) -> list[dict[str, Any]]:
        """The outputs of the page, once one of them can be accepted."""
        self.until(lambda events: any(o.get("offer") for o in events.news["outputs"]))
        return [*self.news["outputs"]]

    def wait_for_change(self) -> Events:
        before = self.state
        return self.until(lambda events: events.state != before)

    def rules(self) -> list[str]:
        return [problem["rule"] for problem in self.news["problems"]]

    def wait_until_settled(self, *rules: str) -> Events:
        """Wait until the preview is no longer busy and reports exactly these rules."""
        return self.until(lambda events: events.news["busy"] == "" and events.rules() == [*rules])


def _events(stream: Iterable[bytes]) -> Iterator[tuple[str, str]]:
    name, silent = "", 0
    for raw in stream:
        line = raw.decode().rstrip("\r\n")
        if line == ": still here":  # nothing was sent for some seconds
            silent += 1
            if silent == 20:
                return  # whoever waits tells what came last
        elif line.startswith("event: "):
            name = line.removeprefix("event: ")
        elif line.startswith("data: "):
            silent = 0
            yield name, line.removeprefix("data: ")


@contextlib.contextmanager
def serve_preview(
    folder: Folder, *arguments: str, env: Mapping[str, str] | None = None, code: str = ""
) -> Iterator[Preview]:
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    process = folder.start("serve", "--port", "0", *arguments, env=env, code=code, **pipes)
    with kill_at_end(process):
        yield Preview(folder, process)
    wait_until_alone(folder)
