"""`coursebuild serve`: the course as a site in memory that follows every save.

1. The course is read; its pages are drawn on demand.
2. A thread takes saves (`live_course`): the page that was saved is new within milliseconds.
3. The main thread does the rest in the background (`rebuild`): scripts, labs, fonts, whole checks.

While something is wrong, the last good page stays, with the mistakes shown over it.

Beside that, a `CommandServer` does commands for other terminals, in the place of their processes:

1. The server is a copy of the preview's process, made before that has threads, with everything
   imported that commands need. So a command, which comes as in `handover`, begins at once.
2. Each runs in a copy of the server, with the working folder, the environment, the limits and the
   standard streams of whoever sent it. It does what it would do elsewhere: the course is read anew.
3. Beside it another copy waits for its end, and passes signals on. When the sender goes away, it
   ends the command. If the preview ends, commands that have begun go on to their end.

The preview itself holds the lock of the course only while it writes, and a script that both need
runs once (`RunStore.claim`). So the command need not wait for the preview.
"""

from __future__ import annotations

import argparse
import contextlib
import functools
import gc
import importlib
import itertools
import json
import os
import re
import resource
import select
import signal
import socket
import sys
import tempfile
import threading
import time
import webbrowser
from collections.abc import Callable
from errno import EADDRINUSE
from pathlib import Path
from typing import Any, NoReturn

import segno

from coursebuild.cli import handover
from coursebuild.cli.arguments import add_running, options_of, style_of
from coursebuild.cli.handover import SIGNALS, ask_preview, send
from coursebuild.cli.output import CLEAN, FAILURE, say
from coursebuild.core.engine.lifetime import end_with_parent
from coursebuild.core.engine.page_pool import can_fork
from coursebuild.core.registry import installed_features
from coursebuild.pipeline.options import UsageError
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
    host, port = arguments.host, arguments.port
    live_course = LiveCourse(options, style_of(sys.stderr))
    try:
        server = PreviewServer(host, port, live_course.session, tuple(arguments.embed))
    except OSError as error:
        message = f"port {port} of {host} cannot be used: {error.strerror or error}"
        raise UsageError(message, help=_propose_port(host, port, error)) from None
    links = server.links
    preview = {"host": host, "port": server.access.port, "links": links, "process": os.getpid()}
    # For what is given in other terminals; now, while this process has no threads.
    commands = CommandServer(options.root, preview) if served is None else None
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


# --- commands for other terminals

_PASSED_ON = frozenset({*SIGNALS, signal.SIGSTOP, signal.SIGCONT})
_GRACE = 10.0
"""Seconds in which a command ends whose sender is gone."""
_WARM_UP = 1.0
"""Seconds after which a server without work imports what commands need."""
_NEEDED = (
    *(f"coursebuild.cli.{n}" for n in ("build", "check", "export", "extract", "undo", "update")),
    *(f"coursebuild.features.authoring.commands.{n}" for n in ("fmt", "new", "rename")),
    "coursebuild.core.run.script_server",
    "coursebuild.features.lab.trial",
    "coursebuild.features.lab.picture.static",
)


class CommandServer:
    """Takes commands for a course as long as a preview runs."""

    def __init__(self, root: Path, preview: dict[str, Any]) -> None:
        """Listen; `preview` is what the preview says of itself, to a second one.

        Where this process cannot be copied, or nobody else is kept from the socket, no commands are
        taken.
        """
        self._root = str(root.resolve())
        place = handover.socket_place(self._root)
        self._place = None if place is None else Path(place)
        self._events: socket.socket | None = None
        with contextlib.suppress(OSError):
            listener = self._listen() if can_fork() else None
            if listener is not None:
                ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
                if os.fork() == 0:
                    _end_with(lambda: _serve_commands(listener, theirs, self._root, preview))
                theirs.close()
                listener.close()
                self._events = ours

    def _listen(self) -> socket.socket | None:
        if self._place is None:
            return None
        self._place.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        if not handover.is_private(str(self._place.parent)):
            return None
        listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        new = self._place.with_suffix(f".{os.getpid()}")
        mask = os.umask(0o177)
        try:
            new.unlink(missing_ok=True)
            listener.bind(str(new))
            listener.listen(16)
            self._inode = new.stat().st_ino
            new.rename(self._place)  # in the place of one that was left behind
        finally:
            os.umask(mask)
        return listener

    def follow(self, tell: Callable[[dict[str, Any]], None]) -> None:
        """Report what is done, as long as commands are taken."""
        with contextlib.suppress(OSError, ValueError):
            while self._events is not None and (data := self._events.recv(1 << 16)):
                tell(json.loads(data))

    def close(self) -> None:
        """Take no more commands."""
        if self._events is not None:
            with contextlib.suppress(OSError):
                if self._place is not None and self._place.stat().st_ino == self._inode:
                    self._place.unlink()
            with contextlib.suppress(OSError):
                self._events.shutdown(socket.SHUT_RDWR)
            self._events.close()


def _end_with(work: Callable[[], object]) -> NoReturn:
    status = FAILURE
    try:
        status = int(work() or 0)  # type: ignore[call-overload]
    finally:
        os._exit(status)


def _close_all_but(*files: int) -> None:
    edges = [2, *sorted(files), 1 << 16]
    for before, after in itertools.pairwise(edges):
        os.closerange(before + 1, after)


def _serve_commands(
    listener: socket.socket, events: socket.socket, root: str, preview: dict[str, Any]
) -> None:
    os.setsid()  # Ctrl-C in the preview's terminal is not for commands of others
    for number in (*SIGNALS, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)
    null = os.open(os.devnull, os.O_RDWR)
    for stream in range(3):
        os.dup2(null, stream)
    _close_all_but(listener.fileno(), events.fileno())
    wait: float | None = _WARM_UP
    state, modules = handover.process_state(), list(_NEEDED)
    while True:
        ready, _, _ = select.select([listener, events], [], [], wait)
        if events in ready:  # nothing comes here but the end
            return
        if not ready and modules:  # one at a time, as commands may come
            importlib.import_module(modules.pop(0))
            wait = 0.0
        elif not ready:
            installed_features()
            wait = None
            gc.collect()
            gc.freeze()  # copies share what is not looked through
        if listener in ready:
            with contextlib.suppress(OSError):
                connection, _ = listener.accept()
                if os.fork() == 0:
                    work = functools.partial(_attend, connection, events, root, state, preview)
                    _end_with(work)
                connection.close()


def _attend(
    connection: socket.socket,
    events: socket.socket,
    root: str,
    state: str | None,
    preview: dict[str, Any],
) -> None:
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    _close_all_but(connection.fileno(), events.fileno())
    files: list[int] = []
    connection.settimeout(60.0)
    request = (
        handover.receive(connection, files) if handover.is_own_process(connection) else None
    ) or {}
    match request:
        case {"ask": "preview"}:
            send(connection, preview)
        case {"ask": "command", "words": [command, *_]} if command in handover.COMMANDS:
            if request["root"] != root or len(files) != 4:
                send(connection, {"refusal": "belongs to another course"})
            elif state is None or request["state"] != state:
                send(connection, {"refusal": "runs another version or Python environment"})
            else:
                _supervise(connection, events, request, files)
        case _:
            send(connection, {"refusal": "does not know this command"})


def _supervise(
    connection: socket.socket, events: socket.socket, request: dict[str, Any], files: list[int]
) -> None:
    """Start a command, pass signals on to it, and tell how it ended."""
    wake, waker = socket.socketpair()
    waker.setblocking(False)
    signal.signal(signal.SIGCHLD, lambda *_: None)
    signal.set_wakeup_fd(waker.fileno())
    supervisor, began, line = os.getpid(), time.monotonic(), " ".join(request["words"])
    job = os.fork()
    if job == 0:
        signal.set_wakeup_fd(-1)
        signal.signal(signal.SIGCHLD, signal.SIG_DFL)
        end_with_parent(supervisor)
        _end_with(lambda: _run(request, files))
    for file in files:
        os.close(file)
    send(connection, {"process": job})
    _report(events, {"process": job, "command": line})
    connection.setblocking(False)
    process, status, until, sources = 0, 0, None, [wake, connection]
    while process != job:
        ready, _, _ = select.select(sources, [], [], None if until is None else _GRACE)
        if until is not None and time.monotonic() > until:
            os.kill(job, signal.SIGKILL)
        if connection in ready:
            numbers = b""
            with contextlib.suppress(OSError):
                numbers = connection.recv(64)
            for number in numbers:
                if number in _PASSED_ON:
                    os.kill(job, number)
            if not numbers:  # whoever sent it is gone
                sources, until = [wake], time.monotonic() + _GRACE
                os.kill(job, signal.SIGTERM)
                os.kill(job, signal.SIGCONT)
        if wake in ready:
            wake.recv(64)
        process, status = os.waitpid(job, os.WNOHANG)
    code = os.waitstatus_to_exitcode(status)
    code = code if code >= 0 else 128 - code
    seconds = time.monotonic() - began
    _report(events, {"process": job, "command": line, "status": code, "seconds": seconds})
    connection.setblocking(True)
    with contextlib.suppress(OSError):
        send(connection, {"status": code})


def _report(events: socket.socket, event: dict[str, Any]) -> None:
    with contextlib.suppress(OSError):  # the preview has ended
        events.send(json.dumps(event).encode(), socket.MSG_DONTWAIT)


def _run(request: dict[str, Any], files: list[int]) -> int:
    """Do a command as the process that sent it would."""
    folder, *streams = files
    os.fchdir(folder)
    for number, stream in enumerate(streams):
        os.dup2(stream, number)
    _close_all_but()
    os.umask(request["umask"])
    for name, soft in request["limits"].items():
        with contextlib.suppress(OSError, ValueError):
            resource.setrlimit(int(name), (soft, resource.getrlimit(int(name))[1]))
    os.environ.clear()
    os.environ.update(request["environment"])
    time.tzset()
    tempfile.tempdir = None
    modes = ("r", "w", "w")
    sys.stdin, sys.stdout, sys.stderr = (
        None
        if number in request["closed"]
        else open(number, mode, encoding="utf-8", errors="replace", closefd=False)  # noqa: SIM115
        for number, mode in enumerate(modes)
    )
    sys.argv[1:] = request["words"]
    from coursebuild.cli.commands import run

    try:
        status = run(request["directory"], request["words"], alone=True)
    except SystemExit as end:
        status = end.code if isinstance(end.code, int) else FAILURE
    except BaseException:
        sys.excepthook(*sys.exc_info())
        status = FAILURE
    for output in (sys.stdout, sys.stderr):
        with contextlib.suppress(OSError, ValueError):
            if output is not None:
                output.flush()
    return status
