"""Runs commands in forked children that end themselves at a given call of the system.

    python killed_commands.py < requests > replies

A request is a line of JSON, `{"folder": …, "arguments": […], "fatal": N, "exchanges": …}`. The
child runs the command in this folder and ends itself, without any cleaning up, just before its call
number N that changes something in the folder; a write that is hit writes half. With `"fatal": 0` it
gets through. `exchanges`: whether the system can swap two folders in one step.
A reply is `{"status": …, "calls": [names]}`; there are no names where it died.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from coursebuild.cli import main
from coursebuild.core.engine import publish as publishing

BY_PATH = ("open", "rename", "replace", "link", "unlink", "rmdir", "mkdir")
BY_FD = ("write", "fsync", "ftruncate", "fchmod")
DIED = 137


class Doom:
    """Counts the calls and knows the fatal one."""

    def __init__(self, folder: Path, fatal: int) -> None:
        self.folder = str(folder)
        self.fatal = fatal
        self.calls: list[str] = []

    def meets(self, name: str) -> bool:
        """Note a call; whether it is the fatal one."""
        self.calls.append(name)
        return len(self.calls) == self.fatal

    def concerns(self, name: str, arguments: tuple[Any, ...]) -> bool:
        if name in BY_FD:
            return self.place(arguments[0]).startswith(self.folder)
        path = arguments[0]
        if name == "open" and not arguments[1] & os.O_CREAT:
            return False
        # Relative ones are those of a tree that is being removed, or of a course as a whole.
        return not Path(path).is_absolute() or os.fspath(path).startswith(self.folder)

    def place(self, fd: int) -> str:
        try:
            return str(Path(f"/proc/self/fd/{fd}").readlink())
        except OSError:
            return ""

    def wrap(self, name: str, really: Callable[..., Any]) -> Callable[..., Any]:
        def call(*arguments: Any, **named: Any) -> Any:
            if self.concerns(name, arguments) and self.meets(name):
                if name == "write":
                    really(arguments[0], bytes(arguments[1])[: len(arguments[1]) // 2])
                os._exit(DIED)
            return really(*arguments, **named)

        return call


def serve() -> None:
    for line in sys.stdin:
        request = json.loads(line)
        read, write = os.pipe()
        child = os.fork()
        if child == 0:
            os.close(read)
            if not request["exchanges"]:
                publishing.exchange = lambda a, b: False
            run(Path(request["folder"]), request["arguments"], request["fatal"], write)
        os.close(write)
        with os.fdopen(read) as pipe:
            calls = pipe.read()
        status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        print(json.dumps({"status": status, "calls": calls.split()}), flush=True)


def run(folder: Path, arguments: list[str], fatal: int, report: int) -> None:
    """Be the child."""
    null = os.open(os.devnull, os.O_RDWR)
    os.dup2(null, 0)
    os.dup2(null, 1)
    os.chdir(folder)
    doom = Doom(folder, fatal)
    for name in (*BY_PATH, *BY_FD):
        setattr(os, name, doom.wrap(name, getattr(os, name)))
    really = publishing.exchange

    def exchange(a: Path, b: Path) -> bool:
        if doom.meets("exchange"):
            os._exit(DIED)
        return really(a, b)

    publishing.exchange = exchange
    status = 70
    try:
        status = main(arguments)
    finally:
        with os.fdopen(report, "w") as pipe:
            pipe.write(" ".join(doom.calls))
        os._exit(status)


if __name__ == "__main__":
    serve()
