"""What a hostile script tries in the sandbox, and how that must end: see `fixtures/sandbox.toml`.

`ATTEMPTS` are expressions of which one script tries all, `EXCESSES` scripts that take too much.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import platform
import socket
import subprocess
import sys
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path

import msgspec
from msgspec import Struct

from coursebuild.core.model.results import Outcome, ScriptRun
from support.fixture_cases import fixture_text

SECRET = "hush"
"""What nobody in the sandbox may print."""
KEY_NAME = "coursebuild-probe"
_KEYRING = -3  # the session's; see keyctl(2)
_HELPERS = fixture_text("scripts/probe_helpers.txt")
"""What a script defines that tries the attempts."""


class Excess(Struct, frozen=True):
    """A script that takes too much."""

    code: str
    outcome: Outcome
    message: str
    """Part of what it, or the tool about it, says on its standard error."""
    memory: int = 256
    """The MiB that it may take."""
    timeout: float = 60.0


_CASES = tomllib.loads(fixture_text("sandbox.toml"))
CALLS: dict[str, int] = {
    name: numbers[platform.machine() != "x86_64"] for name, numbers in _CASES["calls"].items()
}
"""The numbers of system calls on this machine."""
ATTEMPTS = msgspec.convert(_CASES["attempts"], dict[str, str | tuple[str, ...]])
"""What a script tries, and how the result begins: that of an attempt, or the name of its error."""
EXCESSES = msgspec.convert(_CASES["excesses"], dict[str, Excess])
"""Scripts that take too much, and how they end."""


@contextlib.contextmanager
def surroundings(root: Path, home: Path) -> Iterator[Mapping[str, object]]:
    """What scripts would find outside, by the names in `ATTEMPTS`, and what nobody may touch."""
    (home / "secret").write_text(SECRET)
    (root / "lesson.md").write_text("as it was")
    abstract = f"\0coursebuild-{os.getpid()}"
    with contextlib.ExitStack() as stack:
        streams = [_listen(stack, root / path) for path in ("stream", "deep/er/stream")]
        streams.append(_listen(stack, abstract))
        datagrams = stack.enter_context(socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM))
        _bind(datagrams, root / "datagrams")
        pipes = []
        for path in ("pipe", "deep/er/pipe", "runs/pipe"):
            (root / path).parent.mkdir(parents=True, exist_ok=True)
            os.mkfifo(root / path)
            pipes.append(os.open(root / path, os.O_RDWR | os.O_NONBLOCK))
            stack.callback(os.close, pipes[-1])
        (root / "linked-pipe").symlink_to(root / "pipe")
        program = [sys.executable, "-c", "print(flush=True); import time; time.sleep(600)"]
        environment = {**os.environ, "SECRET": SECRET}
        neighbour = stack.enter_context(
            subprocess.Popen(program, env=environment, stdout=subprocess.PIPE)
        )
        stack.callback(neighbour.kill)
        assert neighbour.stdout is not None and neighbour.stdout.readline()
        yield {
            "CALLS": CALLS,
            "KEY": _add_key(stack),
            "OTHER": neighbour.pid,
            "TESTS": os.getpid(),
            "ABSTRACT": abstract,
        }
        for listener in (*streams, datagrams):
            listener.setblocking(False)
            with contextlib.suppress(BlockingIOError):
                raise AssertionError(
                    listener.recv(9) if listener is datagrams else listener.accept()
                )
        for pipe in pipes:
            with contextlib.suppress(BlockingIOError):
                raise AssertionError(os.read(pipe, 9))
        assert neighbour.poll() is None
        assert (root / "lesson.md").read_text() == "as it was"
        assert [path.name for path in home.iterdir()] == ["secret"]


def _listen(stack: contextlib.ExitStack, place: Path | str) -> socket.socket:
    listener = stack.enter_context(socket.socket(socket.AF_UNIX))
    _bind(listener, place)
    listener.listen()
    return listener


def _bind(listener: socket.socket, place: Path | str) -> None:
    """Bind a socket; the path of one in a folder may be too long unless relative."""
    if isinstance(place, str):
        listener.bind(place)
        return
    place.parent.mkdir(parents=True, exist_ok=True)
    with contextlib.chdir(place.parent):
        listener.bind(place.name)


def _add_key(stack: contextlib.ExitStack) -> int:
    """Put the secret into this session's keyring; 0 where the machine has no keys."""
    libc = ctypes.CDLL(None)
    data = SECRET.encode()
    key: int = libc.syscall(CALLS["add_key"], b"user", KEY_NAME.encode(), data, len(data), _KEYRING)
    stack.callback(libc.syscall, CALLS["keyctl"], 9, key, _KEYRING)  # unlink
    return max(key, 0)


def attempts_script(names: Mapping[str, object]) -> str:
    """A script that makes all attempts, and prints a line for each."""
    definitions = "".join(f"{name} = {value!r}\n" for name, value in names.items())
    return _HELPERS + definitions + "".join(f"attempt(lambda: {attempt})\n" for attempt in ATTEMPTS)


def answers(run: ScriptRun) -> dict[str, str]:
    """What became of each attempt that did not end as it must."""
    lines = run.stdout.splitlines()
    if len(lines) != len(ATTEMPTS):
        return {"all": f"{run.outcome.value}, {len(lines)} lines: {run.stderr}"}
    expected = zip(ATTEMPTS.items(), lines, strict=True)
    return {attempt: line for (attempt, end), line in expected if not line.startswith(end)}
