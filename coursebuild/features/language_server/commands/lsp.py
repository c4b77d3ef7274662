"""`coursebuild lsp`: a language server on standard input and output.

The course is followed as in the preview: a thread takes saves, the main thread runs scripts and
labs. A thread answers the client, another reads what is typed, another publishes diagnostics.
Authors' files are only read: the client edits them.
"""

from __future__ import annotations

import argparse
import os
import signal
import threading
import traceback
from collections.abc import Callable
from typing import TYPE_CHECKING, BinaryIO, NoReturn

from msgspec.structs import replace

from coursebuild.api import CLEAN, options_of
from coursebuild.core.files.errors import require
from coursebuild.pipeline.arguments import add_cache
from coursebuild.pipeline.options import Progress
from coursebuild.preview.live_course import LiveCourse
from coursebuild.report import Style

if TYPE_CHECKING:
    from coursebuild.features.language_server.commands.server import Server

EXAMPLES = """\
examples:
  coursebuild lsp -C ~/course            the command that an editor runs
"""


def declare(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    add_cache(parser)
    parser.add_argument(
        "--stdio", action="store_true", help="accepted for editors that pass it; it is always on"
    )


def run(arguments: argparse.Namespace) -> int:
    """Serve until the client disconnects."""
    require("pygls", "lsp", "the language server")
    from coursebuild.features.language_server.commands.server import Server

    options = replace(options_of(arguments), progress=Progress(quiet=True))
    # Nothing else in this process may use the client's streams.
    stdin, stdout = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    os.dup2(2, 1)
    live_course = LiveCourse(options, Style(), site=False)
    server = Server(live_course.session)
    try:
        live_course.start()
        _start_thread(server.read_edits)
        _start_thread(server.publish)
        threading.Thread(target=_answer, args=(server, stdin, stdout), daemon=True).start()
        _repeat(live_course.rebuild)
    except KeyboardInterrupt:  # raised when `_answer` ends
        return CLEAN
    finally:
        live_course.close()


def _answer(server: Server, stdin: BinaryIO, stdout: BinaryIO) -> None:
    server.client.start_io(stdin, stdout)
    main = threading.main_thread().ident
    assert main is not None
    signal.pthread_kill(main, signal.SIGTERM)


def _start_thread(work: Callable[[], None]) -> None:
    threading.Thread(target=_repeat, args=(work,), daemon=True).start()


def _repeat(work: Callable[[], None]) -> NoReturn:
    """Repeat some work forever; an exception only goes to the editor's log."""
    while True:
        try:
            work()
        except Exception:
            traceback.print_exc()
