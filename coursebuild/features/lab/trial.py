"""Trying every lab of a course: models → V8 and native MuJoCo → results and diagnostics.

Entry point: `LabTrials`.

1. Each lab's model is compiled natively and saved; the same bytes go to the browser.
2. Each piece of its code must parse; then the trial takes the lab through everything that a reader
   can do with it, in the engine that the browser has.
3. The main run is repeated natively and compared; for a build, what it recorded becomes the static
   form.
4. The script that the page offers is run natively and compared with it too.

Saved models, trials and pictures are kept, each by the hash of all that it depends on, so that
where nothing has changed neither engine is started.
"""

from __future__ import annotations

import functools
import json
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Self

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.features import Trial, TrialContext, TrialOutcome
from coursebuild.core.model.results import TrialLine, TrialResult
from coursebuild.core.run.child import MEMORY
from coursebuild.core.run.mjcf import model_files
from coursebuild.core.text.diagnostics import Diagnostic, diagnose
from coursebuild.core.text.source import Source, key_of
from coursebuild.core.values import fingerprint
from coursebuild.features.lab.compile import LabModule, compile_lab, pieces
from coursebuild.features.lab.custom import custom_lab
from coursebuild.features.lab.engines.browser import LabEngine
from coursebuild.features.lab.engines.files import lab_digest
from coursebuild.features.lab.engines.native import NativeEngine, NativeError
from coursebuild.features.lab.export.trial import LabExport, exported, recorded
from coursebuild.features.lab.files import LabOutput
from coursebuild.features.lab.inputs import SECONDS, inputs_of, tried_data
from coursebuild.features.lab.model import MJCF, TRIED, Lab
from coursebuild.features.lab.models import model_of_lab, saved_model
from coursebuild.features.lab.names import name_diagnostics, references
from coursebuild.features.lab.reply import MainRun, TrialReply, read_reply, reply_bytes
from coursebuild.features.lab.schema import Camera
from coursebuild.features.lab.verdict import (
    code_diagnostic,
    failure_diagnostics,
    remark_diagnostics,
)

_PARITY_SECONDS = 1.0
"""Simulated time over which the size of a difference counts, unless a lab says how much is allowed.
"""
_TRANSIENT = ("timeout", "engine")
"""Kinds of failure that may not happen again: a trial that ends in one is not kept."""


class Engines:
    """The browser's engine and the native one; each is started when it is first needed."""

    def __init__(self, root: Path, memory: int = MEMORY) -> None:
        self.native = NativeEngine(root, memory=memory)
        self.browser = LabEngine(memory)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        try:
            self.browser.close()
        finally:
            self.native.__exit__(*error)

    def stop(self) -> None:
        """From another thread: end what runs, and let nothing begin."""
        self.browser.stop()
        self.native.interrupt()


class LabTrials:
    """Trials of labs whose models compile; a lab in which something is wrong is left out."""

    def __init__(
        self, context: TrialContext, engines: Engines | None = None, seconds: float = SECONDS
    ) -> None:
        """`seconds`: processor time that a trial may take."""
        self._context, self._seconds = context, seconds
        self._engines = engines or Engines(context.root, context.course.limits.memory)

    def run(self, trials: Sequence[Trial]) -> TrialOutcome:
        """Try them in turn, and end the engines."""
        results: list[TrialResult] = []
        found: list[Diagnostic] = []
        with self._engines:
            for trial in trials:
                result, diagnostics = self._try(trial)
                results += () if result is None else (result,)
                found += diagnostics
        return tuple(results), tuple(found)

    def _try(self, trial: Trial) -> tuple[TrialResult | None, list[Diagnostic]]:
        context, engines, lab = self._context, self._engines, trial.block
        assert isinstance(lab, Lab)
        if any(lab.span.contains(diagnostic.span) for diagnostic in context.diagnostics):
            return None, []
        if not (lab.is_of_text or context.static):
            return None, []  # which nothing is claimed of, and nobody looks at
        if lab.kind not in TRIED:
            return custom_lab(context, engines.native, trial, lab)
        model = model_of_lab(context, lab)
        if model is None:
            return None, []
        result, found = _Attempt(context, engines, self._seconds, trial, lab, model).run()
        return result, found if lab.is_of_text else []

    def stop(self) -> None:
        """From another thread: end what runs, and let nothing begin."""
        self._engines.stop()


class _Findings(Struct, frozen=True):
    """What follows from the reply of a trial."""

    reply: TrialReply
    failures: tuple[Diagnostic, ...]
    """What the lab cannot be shown with."""
    remarks: tuple[Diagnostic, ...]
    output: LabOutput
    """Without its model and its script."""


class _Attempt(Struct, frozen=True):
    """Trying one lab."""

    context: TrialContext
    engines: Engines
    seconds: float
    trial: Trial
    lab: Lab
    model: Source

    def run(self) -> tuple[TrialResult | None, list[Diagnostic]]:
        """What became of it, and what is wrong."""
        began = time.monotonic()
        lab = self.lab
        module = compile_lab(lab, self.trial.name)
        inputs = inputs_of(lab, module)
        try:
            mjb = saved_model(self.context, self.engines.native, self.model)
            key = fingerprint((inputs.text, inputs.conditions, mjb))
            read = functools.partial(self._read, module, key)
            findings = self.context.memory.store.get("labs", key, read, shared=True)
            cached = findings is not None
            if findings is None:
                mistakes = self._mistakes(mjb)
                if mistakes:
                    return self._failed(module, began), mistakes
                findings = read(self._try(module, mjb, key))
        except NativeError as error:
            wrong = diagnose("lab-engine", lab.place(()), f"native MuJoCo {error}")
            return self._failed(module, began), [wrong]
        reply, found = findings.reply, findings.failures
        offer = LabExport(None) if found else self._export(reply)
        path, text = self.model.path, self.model.text
        own = () if lab.xml is not None else (path,)
        self.context.memory.note_trial(
            inputs,
            (*own, *model_files(self.context.root, path, text)),
            ok=not found,
            lasting=_is_lasting(reply),
            seconds=reply.seconds,
            timestamp=reply.made,
        )
        line = TrialLine(
            name=module.name,
            title=lab.fields.title,
            lesson=self.trial.owner,
            status="failed" if found else "ok",
            seconds=reply.seconds if cached else time.monotonic() - began,
            steps_per_second=reply.steps_per_second,
            tried=len(reply.tried),
            parity=_parity_text(reply, offer),
            fill=None if reply.main is None else reply.main["fill"],
            cached=cached,
            unexported=offer.reason,
        )
        output = replace(findings.output, mjb=mjb, script=offer.script)
        return TrialResult(lab.span, line, output), [*found, *findings.remarks]

    def _read(self, module: LabModule, key: str, data: bytes) -> _Findings:
        """All that follows from a reply that is kept.

        Where it is none, which somebody may have put there, something is raised.
        """
        from coursebuild.features.lab.picture.static import lab_record

        lab, reply = self.lab, read_reply(data)
        if reply.main is None and not reply.failures:
            raise ValueError("a lab starts, or it is said why not")
        failures = tuple(failure_diagnostics(lab, reply)) if lab.is_of_text else ()
        remarks, main = tuple(remark_diagnostics(lab, reply)), reply.main
        output = LabOutput(module.code, _framed(module.config, main))
        if self.context.static and not failures and main is not None:
            picture = self._picture(key, main)
            output = replace(output, record=lab_record(lab, main), picture=picture)
        return _Findings(reply, failures, remarks, output)

    def _failed(self, module: LabModule, began: float) -> TrialResult:
        """A lab that could not be tried."""
        seconds = time.monotonic() - began
        title = self.lab.fields.title
        line = TrialLine(module.name, title, self.trial.owner, "failed", seconds)
        return TrialResult(self.lab.span, line, LabOutput(module.code, module.config))

    def _mistakes(self, mjb: bytes) -> list[Diagnostic]:
        """What no engine could run, and what the code names and is not there."""
        browser, code = self.engines.browser, tuple(pieces(self.lab))
        wrong = browser.mistakes(code)
        found = [
            code_diagnostic(self.lab, piece, text)
            for piece, text in zip(code, wrong, strict=True)
            if text is not None
        ]
        if found:
            return found
        named = references(self.lab)
        paths = [reference.path for reference in named]
        return list(name_diagnostics(named, browser.look_up(paths, mjb, self.seconds)))

    def _try(self, module: LabModule, mjb: bytes, key: str) -> bytes:
        """The reply of the trial, with the comparison in place of what it was made from."""
        request = {
            "config": tried_data(module),
            "code": module.literal,
            "seconds": self.lab.verify.seconds,
        }
        began = time.monotonic()
        reply = self.engines.browser.trial(request, mjb, self.seconds)
        main = reply["main"]
        if main is not None and main["parity"] is not None:
            main["recorded"] = recorded(main["parity"], self._horizon(main))
            main["parity"] = self._compared(main, mjb)
        reply["seconds"] = round(time.monotonic() - began, 4)
        reply["made"] = int(time.time())
        data = reply_bytes(reply)
        if _is_lasting(read_reply(data)):
            self.context.memory.store.put("labs", key, data, shared=True)
        return data

    def _compared(self, main: dict[str, Any], mjb: bytes) -> dict[str, Any]:
        """How the main run compares with native MuJoCo, or why it cannot be repeated."""
        run = main["parity"]
        if main["diverged"]:
            run["steps"] -= 1  # what is beyond all numbers may differ
        if run["steps"] == 0:
            return {"unrepeated": "it takes no step"}
        if run["modelChanged"]:
            return {"unrepeated": "its controller changes the model"}
        if not run["complete"]:
            return {"unrepeated": "its controller writes more than can be kept"}
        compared = self.engines.native.parity(mjb, run, self._horizon(main))
        return {**compared, "steps": run["steps"]}

    def _horizon(self, main: dict[str, Any]) -> int:
        """The step up to which the size of a difference counts."""
        steps = int(main["parity"]["steps"])
        if self.lab.verify.rtol is not None:
            return steps
        return min(steps, max(1, round(_PARITY_SECONDS / float(main["timestep"]))))

    def _export(self, trial: TrialReply) -> LabExport:
        """The script that does what the lab does."""
        if trial.main is None or self.lab.kind == MJCF:
            return LabExport(None)
        return exported(self.context, self.engines.native, self.trial, self.lab, trial.main)

    def _picture(self, key: str, main: MainRun) -> bytes:
        """The start of the main run, drawn."""
        from coursebuild.features.lab.picture.static import draw_picture

        drawn = key_of(key, str(self.lab.fields.height), lab_digest("picture"))
        store = self.context.memory.store
        return store.get_or_create("pictures", drawn, lambda: draw_picture(self.lab, main))


def _framed(config: str, main: MainRun | None) -> str:
    """A lab's data with the camera that its trial has found."""
    if main is None:
        return config
    camera = {name: main["scene"]["camera"][name] for name in Camera.__struct_fields__}
    data = {**json.loads(config), "camera": camera, "floor": main["scene"]["floor"]}
    data["arrows"] = main["arrows"]
    if "xml" in data:  # which the reader may change, to one that this camera does not suit
        data["extent"] = main["scene"]["extent"]
    return json.dumps(data, ensure_ascii=False, separators=(",", ":"))


def _is_lasting(reply: TrialReply) -> bool:
    """Whether the same trial would have the same result another time."""
    return all(failure.kind not in _TRANSIENT for failure in reply.failures)


def _parity_text(reply: TrialReply, offer: LabExport) -> str:
    run = reply.main["parity"] if reply.main is not None else None
    if run is None:
        return ""
    if run.unrepeated and offer.script is not None:
        return "compared with native MuJoCo as its Python export"
    return run.describe()
