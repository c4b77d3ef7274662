"""`coursebuild serve`: the course as a site in memory that follows every save.

1. The course is read; its pages are drawn on demand.
2. A thread takes saves (`live_course`): the page that was saved is new within milliseconds.
3. The main thread does the rest in the background (`rebuild`): scripts, labs, fonts, whole checks.

While something is wrong, the last good page stays, with the mistakes shown over it.
"""

from __future__ import annotations

import argparse
import contextlib
import functools
import os
import re
import socket
import sys
import threading
import webbrowser
from errno import EADDRINUSE
from typing import NoReturn

import segno

from coursebuild.cli.arguments import add_running, options_of, style_of
from coursebuild.cli.command_server import CommandServer
from coursebuild.cli.handover import ask_preview
from coursebuild.cli.output import CLEAN, say
from coursebuild.pipeline.options import Options, UsageError
from coursebuild.preview.live_course import LiveCourse
from coursebuild.preview.server import PreviewServer

EXAMPLES = """\
examples:
  coursebuild serve --open           and open it in a browser
  coursebuild serve --host 0.0.0.0   for other machines too, by a link with a token
"""


_PORT = 8000


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
        help="address to listen on (default: %(default)s, this machine only); with any "
        "other address, browsers need the printed link with its token",
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
    served = ask_preview(str(options.root))
    if served is not None and arguments.host == served["host"] and not arguments.embed:
        link = served["links"][0]
        if arguments.port in (_PORT, 0, served["port"]):
            say(CLEAN, f"serving {link} already (process {served['process']})")
            if arguments.open:
                webbrowser.open(link)
            return CLEAN
    _serve(options, arguments, takes_commands=served is None)


def _serve(options: Options, arguments: argparse.Namespace, *, takes_commands: bool) -> NoReturn:
    """Serve until interrupted; `takes_commands`: do what is given in other terminals."""
    host, port = arguments.host, arguments.port
    live_course = LiveCourse(options, style_of(sys.stderr))
    try:
        server = PreviewServer(host, port, live_course.session, tuple(arguments.embed))
    except OSError as error:
        message = f"port {port} of {host} cannot be used: {error.strerror or error}"
        raise UsageError(message, help=_propose_port(host, port, error)) from None
    links = server.links
    preview = {"host": host, "port": server.access.port, "links": links, "process": os.getpid()}
    # Now, while this process has no threads.
    commands = CommandServer(options.root, preview) if takes_commands else None
    try:
        live_course.start()
        server.start()
        if commands is not None:
            follow = functools.partial(commands.follow, live_course.tell_command)
            threading.Thread(target=follow, name="commands", daemon=True).start()
        draw = options.progress.live
        first, *other_links = links
        print(f"serving {first} (stop with Ctrl-C)", file=sys.stderr, flush=True)
        for link in other_links:
            print(f"     or {link}", file=sys.stderr, flush=True)
        if draw and "?" in links[-1]:
            segno.make(links[-1]).terminal(sys.stderr, compact=True)
        if arguments.open:  # in a thread, as some browsers only return when their window is open
            browse = functools.partial(webbrowser.open, first)
            threading.Thread(target=browse, name="open", daemon=True).start()
        live_course.rebuild()
    finally:
        if commands is not None:
            commands.close()
        server.stop()
        live_course.close()


def _propose_port(host: str, port: int, error: OSError) -> str:
    for number in range(port + 1, min(port + 100, 65536)) if error.errno == EADDRINUSE else ():
        with contextlib.suppress(OSError), socket.create_server((host, number)):
            option = "" if host == "127.0.0.1" else f" --host {host}"
            return f"`coursebuild serve{option} --port {number}`"
    return ""
