"""A child process that answers JSON lines, for work that may crash or hang.

It runs a file of this package in a temporary folder and a clean environment, says `ready`, then
answers each line with one. It is started with the first request, again after it died, and ends
with the thread that uses it, even if that is killed. In a sandbox it works on what a stranger
wrote: nothing that it says or takes is trusted then, and its limits are enforced from outside.
"""

from __future__ import annotations

import contextlib
import json
import os
import re
import resource
import selectors
import signal
import sys
import tempfile
import time
from typing import Any, Self

from coursebuild.core.files.errors import EffectError, lacking
from coursebuild.core.files.locks import temporary_folder
from coursebuild.core.model import Limits
from coursebuild.core.run import gate
from coursebuild.core.run.script_environment import clean_environment
from coursebuild.core.run.script_worker import PROCESSES, SandboxWatch

LIMITS = Limits()
"""Those of a course whose map sets none."""
_START = 120.0
"""Seconds in which the child must be ready."""
_VIGILANCE = 0.05
"""Seconds between two looks at what a sandbox takes."""
_LONGEST_ANSWER = 1 << 30
"""Bytes."""


class JsonChild:
    """The child and its folder."""

    def __init__(
        self,
        script: str,
        seconds: float,
        python: str | None = None,
        memory: int = LIMITS.memory,
        enclose: gate.Enclose | None = None,
    ) -> None:
        """A child ends itself, by SIGPROF, after `seconds` of processor time for a request.

        Where it does not compute, it is killed after ten times as long. It cannot take more than
        `memory` MiB, where the system can enforce that. `enclose` puts it into a sandbox.
        """
        self.memory = memory
        self._enclose = enclose
        self._watch: SandboxWatch | None = None
        self._excess = ""
        self._python = python or sys.executable
        self._script = script
        self._seconds = self._limit = seconds
        self._resources = contextlib.ExitStack()
        self._folder = ""
        self._process: gate.Process | None = None
        self._interrupted = False
        self.timed_out = False
        """Whether the last request that was not answered took too long."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()
        self._resources.close()
        self._folder = ""

    def ask(self, request: Any, seconds: float | None = None) -> Any:
        """The child's answer; `None` if it died, or said nothing for too long: see `death`.

        `seconds` is another limit for this request.

        Raises:
            EffectError: MuJoCo cannot be loaded, or `interrupt` was called.
            LackError: the machine has too little of what that needs.
        """
        process = self._process or self._start()
        assert process.stdin is not None
        if self._interrupted:
            raise EffectError("interrupted")
        self._limit = self._seconds if seconds is None else seconds
        with contextlib.suppress(BrokenPipeError):  # it died, which reading will show
            process.stdin.write(json.dumps(request).encode() + b"\n")
            process.stdin.flush()
        line = self._read_line(10 * self._limit)
        if line is None:
            return None
        try:
            return json.loads(line)
        except (ValueError, RecursionError):
            if self._watch is None:
                raise
            self._excess = "gave no answer that can be read"
            return None

    def stop(self) -> None:
        """End the child, whatever it is doing."""
        process, self._process = self._process, None
        if process is None:
            return
        gate.end(process)
        if self._watch is not None:
            self._watch.close()
            self._watch = None

    def interrupt(self) -> None:
        """From another thread: end the child and refuse all further requests."""
        self._interrupted = True
        if (process := self._process) is not None:
            process.kill()

    def death(self) -> str:
        """What ended the child, after it gave no answer."""
        assert self._process is not None
        if self._excess:
            self.stop()
            return self._excess
        with contextlib.suppress(gate.StillRunningError):
            self._process.wait(1.0)
        status = self._process.returncode
        self.stop()
        self.timed_out = status is None or status == -signal.SIGPROF
        if self.timed_out:
            return f"took longer than {self._limit:g} s"
        assert status is not None
        if status < 0:
            return f"crashed ({signal.Signals(-status).name})"
        return f"ended with status {status}"

    def _start(self) -> gate.Process:
        self._folder = self._folder or self._resources.enter_context(temporary_folder())
        self._excess, is_enclosed = "", self._enclose is not None
        with tempfile.TemporaryFile() as errors:
            self._process = process = gate.start(
                gate.python_command(self._script, program=self._python),
                clean_environment(os.environ),
                folder=self._folder,
                stdin=gate.PIPE,
                stdout=gate.PIPE,
                stderr=gate.NOTHING if is_enclosed else errors,  # which a stranger would fill
                enclose=self._enclose,
            )
            self._watch = SandboxWatch(process.pid) if is_enclosed else None
            is_ready = self._read_line(_START) == b"ready"
            number = process.pid if self._watch is None else self._watch.first_process()
            if not is_ready or not number:
                self.stop()
                errors.seek(0)
                cause = self._excess or gate.last_line(errors.read()) or "the import crashed"
                match = re.match(r"\w*Error: \[Errno (\d+)\]", cause)
                lack = match and lacking(OSError(int(match[1]), ""))
                raise lack or EffectError(f"MuJoCo cannot be loaded: {cause}")
        with contextlib.suppress(AttributeError, OSError):  # only Linux can
            limits = [(resource.RLIMIT_DATA, self.memory << 20), (resource.RLIMIT_CORE, 0)]
            limits += [(resource.RLIMIT_NPROC, 16 * PROCESSES)] if is_enclosed else []
            for limit, most in limits:
                resource.prlimit(number, limit, (most, most))
        return process

    def _read_line(self, seconds: float) -> bytes | None:
        """The next line of the child; `None` if it died, or sent no whole line in this time."""
        assert self._process is not None and self._process.stdout is not None
        until = time.monotonic() + seconds
        line = bytearray()
        with selectors.DefaultSelector() as selector:
            selector.register(self._process.stdout, selectors.EVENT_READ)
            while not line.endswith(b"\n"):
                left = max(0.0, until - time.monotonic())
                if self._watch is not None:
                    self._excess = self._watch.excess(self.memory)
                    left = min(left, _VIGILANCE)
                if self._excess or len(line) > _LONGEST_ANSWER:
                    return None
                if not selector.select(left):
                    if time.monotonic() < until:
                        continue
                    return None
                data = os.read(self._process.stdout.fileno(), 1 << 20)
                if not data:
                    return None
                line += data
        return bytes(line[:-1])
