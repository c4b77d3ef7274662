"""Runs what readers are handed over as it would run for one of them: alone, in an empty folder.

A run counts as long as the bytes, the packages and the interpreter are the same.
"""

from __future__ import annotations

import base64
import json
import os
import secrets
import sys
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from msgspec import Struct
from msgspec.structs import asdict

from coursebuild.core.engine.digests import file_state
from coursebuild.core.engine.store import Store
from coursebuild.core.model import Limits
from coursebuild.core.run import gate
from coursebuild.core.run.sandbox import Sandbox
from coursebuild.core.run.script_environment import Interpreter, clean_environment, conditions
from coursebuild.core.values import fingerprint

_PROGRAM = Path(__file__).with_name("alone_main.py")
_KEPT_ERRORS = 4096
"""Characters of what it writes to its error stream, from the end."""


class AloneJob(Struct, frozen=True):
    """A file to run, with what it comes with."""

    files: tuple[tuple[str, bytes], ...]
    path: str
    """That of the file to run."""
    arguments: tuple[str, ...]
    figures: tuple[str, ...]
    """The figures that it has to draw."""
    modules: tuple[str, ...]
    """The top-level modules that it may import, besides its own and those of Python."""
    packages: tuple[str, ...]
    """What brings these, with versions."""
    environment: tuple[tuple[str, str], ...]
    timeout: float
    memory: int = Limits().scripts


class AloneRun(Struct, frozen=True):
    """How it ended."""

    failure: str
    """Why it failed, in words; empty where it did not."""
    stdout: str
    kept_back: str = ""
    """The end of it, which the C library held until then."""


class Runner(Struct, frozen=True):
    """Where such files run."""

    root: Path
    store: Store
    interpreter: Interpreter | None
    sandbox: Sandbox | None
    parallel: int

    def run(
        self, jobs: Iterable[AloneJob], on_run: Callable[[], object] = lambda: None
    ) -> tuple[AloneRun, ...]:
        """The runs of these jobs in order; `on_run` is told of each that is done now."""

        def get_or_run(job: AloneJob) -> AloneRun:
            known_run = self.known_run(job)
            if known_run is not None:
                return known_run
            run = self._run(job)
            on_run()
            return run

        with ThreadPoolExecutor(self.parallel, "alone") as threads:
            return tuple(threads.map(get_or_run, jobs))

    def known_run(self, job: AloneJob) -> AloneRun | None:
        """The run of an earlier command, if nothing has changed since."""
        return self.store.get_value("alone", self._key(job), AloneRun)

    def _key(self, job: AloneJob) -> str:
        program = file_state(str(_PROGRAM))
        return fingerprint(
            (program, conditions(os.environ, self.interpreter), job, self.sandbox is not None)
        )

    def _run(self, job: AloneJob) -> AloneRun:
        mark = secrets.token_hex()
        files = {path: base64.b64encode(data).decode() for path, data in job.files}
        request = asdict(job) | {"files": files, "mark": mark}
        environment = {**clean_environment(os.environ), **dict(job.environment)}
        enclose: gate.Enclose | None = None
        if self.interpreter is not None:
            environment = self.interpreter.environment(environment)
        if self.sandbox is not None:
            enclose = self.sandbox.enclosure(self.root, self.interpreter, job.memory)
        # Not by `python_command`: its seed of hashes is that of scripts.
        python = sys.executable if self.interpreter is None else self.interpreter.python
        try:
            completed = gate.finish(
                [python, "-P", str(_PROGRAM)],
                environment,
                stdin=json.dumps(request).encode(),
                seconds=job.timeout,
                enclose=enclose,
            )
        except TimeoutError as error:
            return AloneRun(str(error), "")
        output = completed.output.decode("utf-8", "backslashreplace").replace("\r\n", "\n")
        # Each copy of the process that comes to its end writes the mark.
        printed, *rest = output.split(mark)
        kept_back = "".join(rest)
        failure = ""
        if completed.status:
            last = completed.last_line() or f"it ends with status {completed.status}"
            failure = last[-_KEPT_ERRORS:]
        result = AloneRun(failure, printed + kept_back, kept_back)
        self.store.put_value("alone", self._key(job), result)
        return result
