"""Hands a command to `coursebuild serve`, where that runs for the same course, and waits for it.

The other side is `CommandServer` in `serve`.

1. A preview listens at a Unix socket in a folder that only its user can enter: `coursebuild` in
   `$XDG_RUNTIME_DIR`, or `run` in the state folder. The socket's name is made of the real path of
   the course. Both sides check owner and mode of the folder and, where the system says it, whose
   process is at the other end. A socket that nobody listens at is passed over.
2. A request is a line of JSON. It comes with the descriptors of our working folder and of our
   standard streams, so that the command writes to our terminal itself: what it prints is the same.
3. Ctrl-C and the like are passed on, and the command ends as it would here. If this process ends,
   the command is ended.
4. Another version of the tool, another Python or other packages would do something else. Then the
   command is done here, as without a preview.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import resource
import signal
import socket
import stat
import struct
import sys
from collections.abc import Iterator, Sequence
from typing import Any

from coursebuild.cli.output import FAILURE, say
from coursebuild.cli.unchanged import tool_state
from coursebuild.core.files.course_root import find_course_root
from coursebuild.core.files.trust import state_folder

COMMANDS = frozenset("build check export extract fmt new rename undo update".split())
"""Commands that work on the files of a course, as a preview does. Others read only, make another
course, or measure this machine for minutes and write in a moment."""
SIGNALS = (signal.SIGINT, signal.SIGTERM)
"""Signals that end a command, and that are passed on."""
_DECISIVE = ("PYTHON", "LD_", "DYLD_", "OMP_", "OPENBLAS_", "MKL_")
"""Beginnings of the names of environment variables that are read when a process starts."""
_LONGEST = 100
"""Bytes of a socket's path: systems allow 103 or 107."""
_PATIENCE = 30.0
"""Seconds in which a preview answers, on a busy machine too."""


def socket_place(root: str) -> str | None:
    """The path of the socket of a course's preview; `None` where the user has no place for it."""
    runtime = os.environ.get("XDG_RUNTIME_DIR", "")
    if os.path.isabs(runtime) and is_private(runtime):
        folder = os.path.join(runtime, "coursebuild")
    else:
        state = state_folder(root)
        if state is None:
            return None
        folder = os.path.join(state, "run")
    name = hashlib.sha256(os.fsencode(os.path.realpath(root))).hexdigest()[:32]
    place = os.path.join(folder, name)
    return place if len(os.fsencode(place)) <= _LONGEST else None


def is_private(folder: str) -> bool:
    """Whether a folder is this user's, and no other user can look into it."""
    try:
        status = os.lstat(folder)
    except OSError:
        return False
    is_open = stat.S_IMODE(status.st_mode) & (stat.S_IRWXG | stat.S_IRWXO)
    return stat.S_ISDIR(status.st_mode) and status.st_uid == os.geteuid() and not is_open


def is_own_process(connection: socket.socket) -> bool:
    """Whether the process at the other end is this user's, as far as the system says."""
    if not hasattr(socket, "SO_PEERCRED"):
        return True
    data = connection.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, struct.calcsize("3i"))
    return bool(struct.unpack("3i", data)[1] == os.geteuid())


def process_state() -> str | None:
    """A hash over what two processes have in common that do the same; `None` if it is unclear."""
    tool = tool_state()
    if tool is None:
        return None
    variables = {n: v for n, v in os.environ.items() if n.startswith(_DECISIVE)}
    hard_limits = [resource.getrlimit(limit)[1] for limit in limits()]
    python = (sys.prefix, sys.base_prefix, *sys.flags, *sys.warnoptions)
    encoding = sys.getfilesystemencoding()
    parts = (tool, *python, encoding, *hard_limits, *sorted(variables.items()))
    return hashlib.sha256(repr(parts).encode("utf-8", "surrogateescape")).hexdigest()


def limits() -> list[int]:
    """The system's limits of a process, by number."""
    return sorted({getattr(resource, name) for name in dir(resource) if name.startswith("RLIMIT_")})


# --- the client


def hand_over(directory: str | None, words: list[str]) -> int | None:
    """Let the course's preview do a command; return its exit status.

    `None` where there is no preview that would do the same: then the command is to be done here.
    """
    if not words or words[0] not in COMMANDS:
        return None
    try:
        root = find_course_root(".") if directory is None else os.path.realpath(directory or ".")
    except OSError:
        return None
    with connect(root) as connection:
        if connection is None:
            return None

        streams = (sys.stdin, sys.stdout, sys.stderr)
        mask = os.umask(0o077)
        os.umask(mask)
        request = {
            "ask": "command",
            "root": os.path.realpath(root or ""),
            "state": process_state(),
            "directory": directory,
            "words": words,
            "environment": dict(os.environ),
            "closed": [number for number, stream in enumerate(streams) if stream is None],
            "umask": mask,
            "limits": {number: resource.getrlimit(number)[0] for number in limits()},
        }
        try:
            folder = os.open(".", os.O_RDONLY)
        except OSError:  # it is gone, or may not be read
            return None
        try:
            send(connection, request, [folder, 0, 1, 2])
            answer = receive(connection)
        except OSError:
            answer = None
        finally:
            os.close(folder)
        if answer is None or "refusal" in answer:
            reason = "does not answer" if answer is None else answer["refusal"]
            if not {"-q", "--quiet"} & {*words}:
                say(0, f"the preview of this course {reason}; this command runs without it")
            return None
        return _wait(connection, int(answer["process"]))


def ask_preview(root: str) -> dict[str, Any] | None:
    """What the course's preview says of itself; `None` where there is none."""
    with connect(root) as connection, contextlib.suppress(OSError):
        if connection is not None:
            send(connection, {"ask": "preview"})
            return receive(connection)
    return None


@contextlib.contextmanager
def connect(root: str | None) -> Iterator[socket.socket | None]:
    """Connect to the preview of a course, if there is one, and it is this user's."""
    place = None if root is None else socket_place(root)
    if place is None or not is_private(os.path.dirname(place)) or not os.path.lexists(place):
        yield None
        return

    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as connection:
        connection.settimeout(_PATIENCE)
        try:
            status = os.lstat(place)
            is_ours = stat.S_ISSOCK(status.st_mode) and status.st_uid == os.geteuid()
            if is_ours:
                connection.connect(place)
                is_ours = is_own_process(connection)
        except OSError:  # it was left by a process that was killed
            is_ours = False
        yield connection if is_ours else None


def _wait(connection: socket.socket, process: int) -> int:
    def pass_on(number: int, frame: object) -> None:
        with contextlib.suppress(OSError):
            connection.send(bytes([number]))

    def pause(number: int, frame: object) -> None:
        pass_on(signal.SIGSTOP, frame)
        os.kill(os.getpid(), signal.SIGSTOP)
        pass_on(signal.SIGCONT, frame)

    for number in SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN:  # as in the background
            signal.signal(number, pass_on)
    if signal.getsignal(signal.SIGTSTP) is not signal.SIG_IGN:
        signal.signal(signal.SIGTSTP, pause)
    connection.settimeout(None)
    try:
        answer = receive(connection)
    except OSError:
        answer = None
    for number in SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, signal.SIG_DFL)
    if answer is None:
        message = f"coursebuild: the preview's process {process}, which did this, has ended"
        return say(FAILURE, f"{message}\n  help: no file was damaged; run the command again")
    return int(answer["status"])


# --- messages


def send(connection: socket.socket, message: dict[str, Any], files: Sequence[int] = ()) -> None:
    """Send a message, with open files."""
    data = json.dumps(message).encode()
    head = len(data).to_bytes(4, "big")
    if files:
        socket.send_fds(connection, [head], files)
    else:
        connection.sendall(head)
    connection.sendall(data)


def receive(connection: socket.socket, files: list[int] | None = None) -> dict[str, Any] | None:
    """Receive a message, and add the files that come with it; `None` at the end."""
    if files is None:
        head = connection.recv(4)
    else:
        head, descriptors, _, _ = socket.recv_fds(connection, 4, 8)
        files += descriptors
    size = int.from_bytes(head, "big")
    data = b""
    while len(data) < size:
        part = connection.recv(min(size - len(data), 1 << 20))
        if not part:
            return None
        data += part
    try:
        message = json.loads(data) if len(head) == 4 else None
    except ValueError:
        return None
    return message if isinstance(message, dict) else None
