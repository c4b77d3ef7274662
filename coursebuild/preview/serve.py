"""`coursebuild serve`: the course as a site in memory that follows every save.

Entry point: `serve`.

1. The course is read; its pages are drawn on demand.
2. A thread takes saves (`live_course`): the page that was saved is new within milliseconds.
3. The main thread does the rest in the background (`rebuild`): scripts, labs, fonts, whole checks.

While something is wrong, the last good page stays, with the mistakes shown over it.
"""

from __future__ import annotations

import contextlib
import socket
import sys
import threading
import webbrowser
from errno import EADDRINUSE
from typing import NoReturn

import segno

from coursebuild.pipeline.options import Options, UsageError
from coursebuild.preview.live_course import LiveCourse
from coursebuild.preview.server import PreviewServer
from coursebuild.report import Style


def serve(
    options: Options,
    host: str,
    port: int,
    embed: tuple[str, ...],
    style: Style,
    *,
    browse: bool,
) -> NoReturn:
    """Serve until interrupted.

    `embed`: origins whose pages may show the preview in a frame. `style`: how mistakes are printed.
    `browse`: open a browser.
    """
    live_course = LiveCourse(options, style)
    try:
        server = PreviewServer(host, port, live_course.session, embed)
    except OSError as error:
        message = f"port {port} of {host} cannot be used: {error.strerror or error}"
        raise UsageError(message, help=_propose_port(host, port, error)) from None
    try:
        live_course.start()
        server.start()
        _announce(server.links, browse=browse, draw=options.progress.live)
        live_course.rebuild()
    finally:
        server.stop()
        live_course.close()


def _propose_port(host: str, port: int, error: OSError) -> str:
    """The command with the next port that is free, where the one that was asked for is taken."""
    for number in range(port + 1, min(port + 100, 65536)) if error.errno == EADDRINUSE else ():
        with contextlib.suppress(OSError), socket.create_server((host, number)):
            option = "" if host == "127.0.0.1" else f" --host {host}"
            return f"`coursebuild serve{option} --port {number}`"
    return ""


def _announce(links: list[str], *, browse: bool, draw: bool) -> None:
    """Print the addresses of the preview; draw one that a phone's camera can read."""
    first, *other_links = links
    print(f"serving {first} (stop with Ctrl-C)", file=sys.stderr, flush=True)
    for link in other_links:
        print(f"     or {link}", file=sys.stderr, flush=True)
    if draw and "?" in links[-1]:
        segno.make(links[-1]).terminal(sys.stderr, compact=True)
    if browse:  # in a thread, since some browsers only return when their window is open
        threading.Thread(target=webbrowser.open, args=(first,), name="open", daemon=True).start()
