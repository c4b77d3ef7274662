"""The browser's MuJoCo in this process: V8 runs the same WebAssembly file and the same lab code.

Entry points: `LabEngine.trial`, `LabEngine.mistakes`. See docs/explanation/how-labs-run.md for
what is asked and answered.

The engine is started when it is first needed, and again after a trial that ran too long or took too
much memory: such a trial is told as what it is, and takes no other along.
"""

from __future__ import annotations

import contextlib
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Self

from coursebuild.core.files.errors import EffectError
from coursebuild.core.run.child import MEMORY
from coursebuild.core.run.v8 import Heartbeat, Isolate, LimitError, ScriptError, StoppedError
from coursebuild.features.lab.compile import LabCode
from coursebuild.features.lab.engines.files import script_path, wasm_path

_START_SECONDS = 60.0
_PATIENCE = 5.0
"""Seconds for which a piece of lab code may run at once: the reader's lab stands still as long."""
_PIECES = Path(__file__).with_name("pieces.js")


class LabEngine:
    """Tries labs, one after the other; a context manager for use in one thread."""

    def __init__(self, memory: int = MEMORY, patience: float = _PATIENCE) -> None:
        """`memory`: MiB of JavaScript objects; WebAssembly's memory comes on top.

        `patience`: seconds of processor time for which a trial need not get on.
        """
        self._memory = memory << 20
        self._patience = patience
        self._isolate: Isolate | None = None
        self._stopped = False
        self.version = ""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Free V8's memory; the engine can be used again."""
        if self._isolate is not None:
            self._isolate.close()
            self._isolate = None

    def stop(self) -> None:
        """From another thread: end what runs, and what comes after, by a `StoppedError` there."""
        self._stopped = True
        if (isolate := self._isolate) is not None:
            isolate.stop()

    def mistakes(self, pieces: Sequence[LabCode]) -> list[str | None]:
        """For each piece of code: why it cannot be part of a lab, or `None`."""
        isolate = self._ready()
        asked = [{"code": p.code, "form": p.form, "text": p.function} for p in pieces]
        reply = isolate.call("parsePieces", json.dumps(asked), _START_SECONDS)
        found: list[str | None] = json.loads(reply)
        return found

    def look_up(
        self, paths: Sequence[tuple[str, ...]], mjb: bytes, seconds: float
    ) -> list[dict[str, Any]]:
        """What there is of what lab code names, given its model."""
        isolate = self._ready()
        isolate.fill("mjb", mjb)
        try:
            found: list[dict[str, Any]] = json.loads(
                isolate.call("lookUp", json.dumps(paths), seconds)
            )
        except (LimitError, ScriptError):  # which its trial tells
            self.close()
            return [{} for _ in paths]
        return found

    def trial(self, request: dict[str, Any], mjb: bytes, seconds: float) -> dict[str, Any]:
        """The reply to a trial's request; `seconds` of processor time is what it may take.

        A trial that had to be ended gives a reply with one failure, of the kind `timeout`, at the
        entry whose code was running, or else at what was tried.
        """
        isolate = self._ready()
        try:
            isolate.fill("mjb", mjb)
            progress = Heartbeat(isolate.buffer("beats"), self._patience)
            text = isolate.call("trial", json.dumps(request), seconds, progress)
        except LimitError as error:
            return self._ended(isolate, "timeout", str(error))
        except ScriptError as error:  # lab code has broken what all share
            return self._ended(isolate, "engine", f"the trial broke: {str(error).splitlines()[0]}")
        reply: dict[str, Any] = json.loads(text)
        if any(failure["kind"] in ("engine", "shared") for failure in reply["failures"]):
            self.close()  # what ended or was changed cannot be trusted with the rest
        return reply

    def _ended(self, isolate: Isolate, kind: str, message: str) -> dict[str, Any]:
        entry: list[str | int] = []
        with contextlib.suppress(LimitError, ScriptError):
            told = json.loads(isolate.call("trying", "", _START_SECONDS))
            entry = told["stuck"] or told["trying"]
            if kind == "timeout" and told["stuck"] is None:
                message = "did not finish in time"
        self.close()
        failure = {"entry": entry, "kind": kind, "message": message, "at": None}
        return {"version": self.version, "main": None, "tried": [], "failures": [failure]}

    def _ready(self) -> Isolate:
        if self._stopped:
            raise StoppedError
        isolate = self._isolate or self._start()
        if self._stopped:  # before there was anything to stop
            raise StoppedError
        return isolate

    def _start(self) -> Isolate:
        scripts = (path.read_text(encoding="utf-8") for path in (script_path(), _PIECES))
        self._isolate = isolate = Isolate(*scripts, memory=self._memory)
        try:
            isolate.fill("wasm", wasm_path().read_bytes())
            isolate.call("boot", "", _START_SECONDS)
            self.version = isolate.call("booted", "", _START_SECONDS)
        except (LimitError, ScriptError) as error:
            self.close()
            why = str(error).splitlines()[0]
            raise EffectError(f"the browser's engine does not start: {why}") from None
        return isolate
