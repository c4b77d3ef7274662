"""The browser's MuJoCo in this process: V8 runs the same WebAssembly file and the same lab code.

`site/js/lab/trial/trial.js` describes requests and replies. The engine starts when it is first
needed, and again after a trial that had to be ended, so that such a trial fails alone.
"""

from __future__ import annotations

import contextlib
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from coursebuild.api import EffectError, Source
from coursebuild.core.run.child import LIMITS
from coursebuild.core.run.v8 import Heartbeat, Isolate, LimitError, ScriptError, V8Engine
from coursebuild.features.lab.compile import compile_lab
from coursebuild.features.lab.engines.native import (
    TRIAL,
    WASM,
    NativeEngine,
    NativeError,
    asset_path,
)
from coursebuild.features.lab.model import SIMLAB, Lab, LabCode
from coursebuild.features.lab.schema import SimLab

_START_SECONDS = 60.0
_PATIENCE = 5.0
"""Seconds that one call of lab code may take; the reader's lab would stand still as long."""
_PIECES = Path(__file__).with_name("pieces.js")


class LabEngine(V8Engine):
    """Runs trials, one after the other, in one thread."""

    def __init__(self, memory: int = LIMITS.memory, patience: float = _PATIENCE) -> None:
        """`patience`: seconds of processor time that a trial may take without progress."""
        super().__init__(memory, lambda: (asset_path(TRIAL), _PIECES))
        self._patience = patience
        self.version = ""

    def check_code(self, pieces: Sequence[LabCode]) -> list[str | None]:
        """Say of each piece of code why it cannot be part of a lab; `None` if it can."""
        isolate = self._running_isolate()
        request = [{"code": p.code, "form": p.form, "text": p.function} for p in pieces]
        reply = isolate.call("parsePieces", json.dumps(request), _START_SECONDS)
        messages: list[str | None] = json.loads(reply)
        return messages

    def look_up(
        self, paths: Sequence[tuple[str, ...]], mjb: bytes, seconds: float
    ) -> list[dict[str, Any]]:
        """Say of each name in lab code what exists of it, given the lab's model."""
        isolate = self._running_isolate()
        isolate.fill("mjb", mjb)
        try:
            reply = isolate.call("lookUp", json.dumps(paths), seconds)
        except (LimitError, ScriptError):  # its trial will report it
            self.close()
            return [{} for _ in paths]
        names: list[dict[str, Any]] = json.loads(reply)
        return names

    def trial(self, request: dict[str, Any], mjb: bytes, seconds: float) -> dict[str, Any]:
        """Return the reply to a trial's request; it may take `seconds` of processor time.

        If the trial had to be ended, the reply has one failure, of the kind `timeout`, at the entry
        whose code was running, or else at the entry of the attempt.
        """
        isolate = self._running_isolate()
        try:
            isolate.fill("mjb", mjb)
            progress = Heartbeat(isolate.beats(), self._patience)
            text = isolate.call("trial", json.dumps(request), seconds, progress)
        except LimitError as error:
            return self._end(isolate, "timeout", str(error))
        except ScriptError as error:  # lab code has broken something that all labs share
            return self._end(isolate, "engine", f"the trial failed: {str(error).splitlines()[0]}")
        reply: dict[str, Any] = json.loads(text)
        if any(failure["kind"] in ("engine", "shared") for failure in reply["failures"]):
            self.close()  # an engine that failed or was changed may not run the other labs
        return reply

    def judge(self, request: dict[str, Any], mjb: bytes, seconds: float) -> dict[str, Any]:
        """Return the reply to an attempt at an exercise; it may take `seconds` of processor time.

        Raises:
            LimitError: it takes too much time or memory.
            ScriptError: the engine fails.
        """
        isolate = self._running_isolate()
        isolate.fill("mjb", mjb)
        progress = Heartbeat(isolate.beats(), self._patience)
        try:
            text = isolate.call("judge", json.dumps(request), seconds, progress)
        except (LimitError, ScriptError):
            self.close()
            raise
        reply: dict[str, Any] = json.loads(text)
        return reply

    def _end(self, isolate: Isolate, kind: str, message: str) -> dict[str, Any]:
        entry: list[str | int] = []
        with contextlib.suppress(LimitError, ScriptError):
            progress = json.loads(isolate.call("trying", "", _START_SECONDS))
            entry = progress["stuck"] or progress["trying"]
            if kind == "timeout" and progress["stuck"] is None:
                message = "did not finish in time"
        self.close()
        failure = {"entry": entry, "kind": kind, "message": message, "at": None}
        return {"version": self.version, "main": None, "tried": [], "failures": [failure]}

    def _start(self) -> Isolate:
        isolate = super()._start()
        try:
            isolate.fill("wasm", asset_path(WASM).read_bytes())
            isolate.call("boot", "", _START_SECONDS)
            self.version = isolate.call("booted", "", _START_SECONDS)
        except (LimitError, ScriptError) as error:
            self.close()
            reason = str(error).splitlines()[0]
            raise EffectError(f"the browser's engine does not start: {reason}") from None
        return isolate


_STEPS = 5000
"""The most steps of a run."""
_RUNS = 8
"""The fastest counts: in the first ones V8 compiles."""


def real_time_factor(
    root: Path, source: Source, key: int | None, run: tuple[float, float], seconds: float
) -> float | None:
    """Measure simulated time over the time that it takes; `None` if no run came to its end.

    `run` is the simulated time and the timestep, s; each of several runs may take `seconds`.
    """
    duration, timestep = run
    place = source.span(0, 0)
    module = compile_lab(Lab(place, SIMLAB, place, "", SimLab(key=key)), "speed")
    request = {
        "config": module.config,
        "code": module.literal,
        "seconds": min(duration, _STEPS * timestep),
        "parity": False,
    }
    best = 0
    try:
        with NativeEngine(root) as native:
            mjb = native.save(source.path, source.text)
        with LabEngine() as engine:
            for _ in range(_RUNS):
                reply = engine.trial(request, mjb, seconds)
                if reply["main"] is None:
                    break
                best = max(best, reply.get("stepsPerSecond") or 0)
    except (NativeError, EffectError):
        return None
    return best * timestep if best else None
