"""`coursebuild serve`: the course as a site in memory that follows every save.

1. The course is read; its pages are drawn on demand.
2. A thread takes saves (`live_course`): the page that was saved is new within milliseconds.
3. The main thread does the rest in the background (`rebuild`): scripts, labs, fonts, whole checks.

Commands in other terminals need not wait: the preview holds the lock of the course only while it
writes, and a script that both need runs once (`RunStore.claim`).

A second preview says where the first one is. That has written it into a file in the user's state
folder, which it holds locked as long as it runs; a file that nobody holds says nothing.
"""

from __future__ import annotations

import argparse
import contextlib
import hashlib
import json
import os
import re
import sys
import threading
from collections.abc import Iterator
from html import escape
from pathlib import Path
from typing import Any, BinaryIO

import segno

from coursebuild.core.files.locks import try_lock
from coursebuild.core.files.trust import state_folder
from coursebuild.core.run import gate
from coursebuild.output import CLEAN, say
from coursebuild.pipeline.arguments import add_running, options_of, style_of
from coursebuild.pipeline.options import UsageError
from coursebuild.preview.live_course import LiveCourse
from coursebuild.preview.server import PreviewServer

EXAMPLES = """\
examples:
  coursebuild serve --open           and open it in a browser
  coursebuild serve --host 0.0.0.0   for other machines too
"""


_PORT = 8000
_PATIENCE = 10.0
"""Seconds in which a browser has begun to open a page."""


def declare(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""

    def parse_port(text: str) -> int:
        if text.isdecimal() and int(text) <= 65535:
            return int(text)
        message = f"{text!r} is not a port: a whole number from 0 to 65535"
        raise argparse.ArgumentTypeError(message)

    def parse_origin(text: str) -> str:
        if re.fullmatch(r"[a-z][a-z0-9+.-]*:(//[\w.*\[\]:-]+)?", text):
            return text
        message = f"{text!r} is not an origin, such as https://example.org"
        raise argparse.ArgumentTypeError(message)

    add_running(parser)
    help = "port to listen on (default: %(default)s; 0: any free port)"
    parser.add_argument("--port", type=parse_port, default=_PORT, help=help)
    parser.add_argument(
        "--host",
        default="127.0.0.1",
        help="address to listen on (default: %(default)s, this machine only)",
    )
    parser.add_argument("--open", action="store_true", help="open the preview in a browser")
    parser.add_argument(
        "--embed",
        action="append",
        type=parse_origin,
        default=[],
        metavar="ORIGIN",
        help="let pages of this origin show the preview in a frame, such as vscode-webview:",
    )


def run(arguments: argparse.Namespace) -> int:
    """Serve until it is interrupted; where the course is served so already, only say where."""
    options = options_of(arguments)
    host, port = arguments.host, arguments.port
    with contextlib.ExitStack() as resources:
        notice = resources.enter_context(_private_file(options.root, "json"))
        is_first = notice is None or try_lock(notice.fileno()) is not False
        served = {} if notice is None or is_first else _read_notice(notice)
        is_same = host == served.get("host") and port in (_PORT, 0, served["port"])
        if is_same and not arguments.embed:
            say(CLEAN, f"serving {served['link']} already (process {served['process']})")
            if arguments.open:
                _open_in_browser(options.root, served["link"])
            return CLEAN
        live_course = LiveCourse(options, style_of(sys.stderr))
        try:
            server = PreviewServer(host, port, live_course.session, tuple(arguments.embed))
        except OSError as error:
            message = f"port {port} of {host} cannot be used: {error.strerror or error}"
            raise UsageError(message, help="with `--port 0`, any free one is taken") from None
        resources.callback(live_course.close)
        resources.callback(server.stop)
        live_course.start()
        server.start()
        first, *other_links = server.links
        if notice is not None and is_first:
            place = {"host": host, "port": server.access.port, "link": first}
            _write(notice, json.dumps({**place, "process": os.getpid()}))
        say(CLEAN, f"serving {first} (stop with Ctrl-C)")
        for link in other_links:
            say(CLEAN, f"     or {link}")
        if options.progress.live and not server.is_local:
            segno.make(server.links[-1]).terminal(sys.stderr, compact=True)
        if arguments.open:  # in a thread, as some browsers only return when their window is open
            words = (options.root, first)
            threading.Thread(target=_open_in_browser, args=words, name="open", daemon=True).start()
        live_course.rebuild()


# --- files of this user's own


@contextlib.contextmanager
def _private_file(root: Path, kind: str) -> Iterator[BinaryIO | None]:
    """A file of a course in the user's state folder; `None` where there is no place for it."""
    state = state_folder(str(root))
    name = hashlib.sha256(os.fsencode(root.resolve())).hexdigest()
    flags = os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW
    with contextlib.ExitStack() as resources:
        file = None
        with contextlib.suppress(OSError):
            if state is not None:
                folder = Path(state, "previews")
                folder.mkdir(mode=0o700, parents=True, exist_ok=True)
                path = folder / f"{name}.{kind}"
                file = resources.enter_context(
                    open(path, "r+b", opener=lambda p, _: os.open(p, flags, 0o600))
                )
        yield file


def _write(file: BinaryIO, text: str) -> None:
    file.truncate(0)
    file.seek(0)
    file.write(text.encode())
    file.flush()


def _read_notice(notice: BinaryIO) -> dict[str, Any]:
    """What the preview says of itself that holds the file; empty while it is just starting."""
    with contextlib.suppress(ValueError):
        return dict(json.loads(notice.read()))
    return {}


def _open_in_browser(root: Path, link: str) -> None:
    """Open the preview by a page that only this user can read.

    All users can read the command by which a browser is started, and the link holds the token.
    """
    refresh = f'<meta http-equiv="refresh" content="0; url={escape(link)}">'
    with contextlib.suppress(OSError, gate.StillRunningError), _private_file(root, "html") as page:
        if page is None:
            return
        _write(page, f"<!DOCTYPE html><title>Preview</title>{refresh}\n")
        command = gate.python_command("-m", "webbrowser", Path(page.name).as_uri())
        gate.start(command, gate.environment(*gate.DESKTOP), bound=False).wait(_PATIENCE)
