"""From a save to the page that shows it: the live preview of each tool.

Entry point: `measure_serving`. A lesson is written, and its address is asked for until the answer
has the new sentence in it. Between two questions there is a pause of a millisecond, or of a
fiftieth of the time that has gone by, so that asking does not slow the answer down.
"""

from __future__ import annotations

import functools
import http.client
import socket
import tempfile
import time
from collections.abc import Callable

from benchmarks.measure.building import Site, attempt
from benchmarks.measure.process import CommandError, stop
from benchmarks.measure.tools import environment, lesson_place
from coursebuild.core.run import gate

EDIT_TO_SERVED = "edit to served"
START_LIMIT = 120.0
EDIT_LIMIT = 40.0


def measure_serving(sites: list[Site], rounds: int, edits: int, say: Callable[[str], None]) -> None:
    """Note the seconds of each edit, in rounds over all tools."""
    for turn in range(rounds):
        for site in sites:
            if site.tool.serve_command:
                say(f"preview, round {turn + 1} of {rounds}: {site.tool.title}")
                attempt(site, EDIT_TO_SERVED, functools.partial(one_server, edits=edits), say)


def one_server(site: Site, edits: int) -> None:
    """Start the preview, edit a few times, stop it. The first edit is not counted."""
    port = free_port()
    with tempfile.TemporaryFile() as output:
        process = gate.start(
            site.tool.preview_command(site.folder, port),
            environment(site.places),
            folder=site.folder,
            stdout=output,
            stderr=output,
            bound=False,
        )
        try:
            reader = Reader(process, port, lesson_place(site.tool.address, site.name))
            reader.until("", START_LIMIT)
            time.sleep(1)
            for i in range(edits + 1):
                word = site.edit()
                seconds = reader.until(word, EDIT_LIMIT)
                if i:
                    site.note(EDIT_TO_SERVED, seconds)
                time.sleep(0.5 + seconds)
        except TimeoutError as error:
            output.seek(0)
            text = output.read().decode(errors="replace")[-2000:]
            raise CommandError(f"{error}\n{text}") from None
        finally:
            stop(process)
            site.source.write_text(site.original, encoding="utf-8")


class Reader:
    """Asks for one page, over a connection that stays open as long as the server keeps it."""

    def __init__(self, process: gate.Process, port: int, path: str) -> None:
        self.process = process
        self.connection = http.client.HTTPConnection("127.0.0.1", port, timeout=60)
        self.path = path

    def until(self, word: str, limit: float) -> float:
        """Ask until the page has the word; gives the seconds that it took."""
        start = time.perf_counter()
        while True:
            text = self.get()
            seconds = time.perf_counter() - start
            if text is not None and word in text:
                return seconds
            if self.process.poll() is not None:
                raise TimeoutError(f"the server ended with status {self.process.returncode}")
            if seconds > limit:
                raise TimeoutError(f"{self.path} does not say {word!r} after {seconds:.0f} s")
            time.sleep(max(0.001, seconds / 50))

    def get(self) -> str | None:
        """The page, if there is one now."""
        try:
            self.connection.request("GET", self.path)
            answer = self.connection.getresponse()
            text = answer.read().decode(errors="replace")
        except (OSError, http.client.HTTPException):
            self.connection.close()
            return None
        return text if answer.status == 200 else None


def free_port() -> int:
    """A port that nobody listens on."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])
