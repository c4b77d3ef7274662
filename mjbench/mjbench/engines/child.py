"""The process of an engine, as its parent sees it: it may crash or hang, and is started again."""

from __future__ import annotations

import contextlib
import os
import resource
import selectors
import signal
import subprocess
import sys
import tempfile
import time
from typing import Any, Self

import msgspec

from mjbench.engines import engine_main
from mjbench.engines.engine_main import Reply, Request
from mjbench.machine import this_machine

_MEMORY = 16 << 30
"""Bytes that an engine may take: 4,096 worlds need more than most programs do."""
_START = 120.0
"""Seconds in which it must be ready."""


class EngineChild:
    """An engine in a process of its own, in a temporary folder where it leaves what it compiles."""

    def __init__(self, module: str, name: str, seconds: float) -> None:
        """`seconds`: how long, by the wall, one answer may take."""
        self._module, self._name, self._seconds = module, name, seconds
        self._resources = contextlib.ExitStack()
        self._process: subprocess.Popen[bytes] | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._stop()
        self._resources.close()

    def reply(self, **request: Any) -> Reply:
        """What the engine says; a refusal where its process crashed or took too long."""
        try:
            process = self._process or self._start()
        except OSError as error:
            return Reply(refusal=str(error))
        if process is None:
            return Reply(refusal="its process does not start")
        question = Request(
            tuple(sys.path), self._module, self._name, this_machine().processors, **request
        )
        assert process.stdin is not None
        with contextlib.suppress(BrokenPipeError):  # it died, which reading will show
            process.stdin.write(msgspec.json.encode(question) + b"\n")
            process.stdin.flush()
        line = self._read_line(process, self._seconds)
        if line:
            return msgspec.json.decode(line, type=Reply)
        return Reply(refusal=f"its process {self._death(process)}")

    def _start(self) -> subprocess.Popen[bytes] | None:
        folder = self._resources.enter_context(tempfile.TemporaryDirectory())
        variables = {**os.environ, "TMPDIR": folder}
        self._process = process = subprocess.Popen(
            [sys.executable, "-P", engine_main.__file__],
            cwd=folder,
            env=variables,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        if self._read_line(process, _START) != b"ready\n":
            self._stop()
            return None
        with contextlib.suppress(AttributeError, OSError):  # only Linux can
            resource.prlimit(process.pid, resource.RLIMIT_DATA, (_MEMORY, _MEMORY))
            resource.prlimit(process.pid, resource.RLIMIT_CORE, (0, 0))
        return process

    def _stop(self) -> None:
        process, self._process = self._process, None
        if process is None:
            return
        with contextlib.suppress(OSError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        for pipe in (process.stdin, process.stdout):
            if pipe is not None:
                with contextlib.suppress(BrokenPipeError):
                    pipe.close()

    def _death(self, process: subprocess.Popen[bytes]) -> str:
        """What ended the child, after it gave no answer."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(1.0)
        status = process.returncode
        self._stop()
        if status is None:
            return f"took longer than {self._seconds:g} s"
        if status < 0:
            return f"crashed ({signal.Signals(-status).name})"
        return f"ended with status {status}"

    @staticmethod
    def _read_line(process: subprocess.Popen[bytes], seconds: float) -> bytes:
        """The next line of the child; empty if it died, or sent no whole line in this time."""
        assert process.stdout is not None
        until, line = time.monotonic() + seconds, b""
        with selectors.DefaultSelector() as selector:
            selector.register(process.stdout, selectors.EVENT_READ)
            while not line.endswith(b"\n"):
                if not selector.select(max(0.0, until - time.monotonic())):
                    return b""
                data = os.read(process.stdout.fileno(), 1 << 20)
                if not data:
                    return b""
                line += data
        return line
