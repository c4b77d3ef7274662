"""Trying every lab of a course: models → V8 and native MuJoCo → results and diagnostics.

Entry point: `try_labs(course, models, options, engine)`.

1. Each lab's model is compiled natively and saved; the same bytes go to the browser.
2. Each piece of its code must parse; then the trial takes the lab through everything that a reader
   can do with it, in the engine that the browser has.
3. The main run is repeated natively and compared; what it recorded becomes the static form.

A trial is kept by the hash of all that it depends on: the model, the code, the data and the engine.
"""

from __future__ import annotations

import hashlib
import json
import time
import zlib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack
from typing import Any

from coursebuild.diagnostics import Diagnostic, diagnose
from coursebuild.effects.lab_engine import LabEngine, engine_digest
from coursebuild.effects.native import NativeEngine
from coursebuild.effects.store import kept
from coursebuild.effects.versions import engine_version
from coursebuild.labs.compile import LabModule, compile_lab, pieces
from coursebuild.labs.reply import Trial, read_trial
from coursebuild.labs.verdict import (
    Parity,
    code_diagnostic,
    parity_diagnostics,
    trial_diagnostics,
)
from coursebuild.model import Course, Lab, document_blocks
from coursebuild.pipeline.options import Options
from coursebuild.results import CompileResult, LabResult
from coursebuild.scripts.extract import owners

_WALL = 60.0
"""Seconds that a trial may take."""
_PARITY_SECONDS = 1.0
"""Simulated time over which the size of a difference counts, unless a lab says how much is allowed.
"""


def labs_of(course: Course) -> Iterator[tuple[str, str, Lab]]:
    """Every lab with the id of its lesson or page and its name, in order."""
    for owner, document in owners(course):
        labs = (block for block in document_blocks(document) if isinstance(block, Lab))
        for number, lab in enumerate(labs, 1):
            yield owner, f"{owner}-lab-{number}", lab


def try_labs(
    course: Course,
    models: Mapping[str, CompileResult],
    options: Options,
    engine: LabEngine,
    documents: frozenset[str] | None = None,
    wrong: Sequence[Diagnostic] = (),
) -> tuple[tuple[LabResult, ...], tuple[Diagnostic, ...]]:
    """Try the labs, of all documents or of some, whose models compile.

    A lab of which something is in `wrong` already, such as a keyframe that is not there, is left.
    The engines are started only when there is a lab to try.
    """
    results: list[LabResult] = []
    found: list[Diagnostic] = []
    with ExitStack() as stack:
        workshop: _Workshop | None = None
        for owner, name, lab in labs_of(course):
            if documents is not None and lab.span.path not in documents:
                continue
            if any(lab.span.contains(diagnostic.span) for diagnostic in wrong):
                continue
            source = _source(course, models, lab, name)
            if source is None:
                continue
            if workshop is None:
                workshop = _Workshop(
                    options,
                    stack.enter_context(NativeEngine(options.root)),
                    stack.enter_context(engine),
                )
            result, diagnostics = workshop.work(owner, name, lab, source)
            found += diagnostics
            if result is not None:
                results.append(result)
    return tuple(results), tuple(found)


def _source(
    course: Course, models: Mapping[str, CompileResult], lab: Lab, name: str
) -> tuple[str, str] | None:
    """Path and text of a lab's model; `None` for one that does not compile, as is told already."""
    if lab.kind != "simlab":
        return None
    if lab.xml is not None:
        return f"models/.{name}.xml", lab.xml.text
    compiled = models.get(lab.model or "")
    if compiled is None or compiled.error:
        return None
    return next((m.source.path, m.source.text) for m in course.models if m.name == lab.model)


class _Workshop:
    """The engines, and where trials are kept."""

    def __init__(self, options: Options, native: NativeEngine, engine: LabEngine) -> None:
        self.root = options.root
        self.native = native
        self.engine = engine

    def work(
        self, owner: str, name: str, lab: Lab, source: tuple[str, str]
    ) -> tuple[LabResult | None, list[Diagnostic]]:
        """Try one lab."""
        code = pieces(lab)
        wrong = self.engine.mistakes([(piece.code, piece.form) for piece in code])
        mistakes = [
            code_diagnostic(piece, text)
            for piece, text in zip(code, wrong, strict=True)
            if text is not None
        ]
        if mistakes:
            return None, mistakes
        began = time.monotonic()
        module = compile_lab(lab, name)
        mjb = self.native.save(*source)
        fresh = False

        def make() -> bytes:
            nonlocal fresh
            fresh = True
            return zlib.compress(json.dumps(self._try(lab, module, mjb)).encode())

        reply = json.loads(zlib.decompress(kept(self.root, "labs", _key(lab, module, mjb), make)))
        trial, parity = read_trial(reply), _parity(reply)
        found = list(trial_diagnostics(lab, trial))
        found += self._version(lab, trial)
        if parity is not None:
            found += parity_diagnostics(lab, parity)
        seconds = time.monotonic() - began
        result = _result(owner, lab, module, mjb, trial, parity, found, seconds)
        return _with_cached(result, not fresh), found

    def _try(self, lab: Lab, module: LabModule, mjb: bytes) -> dict[str, Any]:
        """The reply of the trial, with the comparison in place of what it was made from."""
        request = {
            "config": json.loads(module.config),
            "code": module.literal,
            "seconds": lab.verify_seconds,
        }
        reply = self.engine.trial(request, mjb, _WALL)
        main = reply["main"]
        if main is None or main["parity"] is None or main["steps"] == 0:
            return reply
        run = main["parity"]
        if not run["complete"] or run["modelChanged"]:
            main["parity"] = None
            return reply
        horizon = run["steps"]
        if lab.verify_rtol is None:
            horizon = min(horizon, max(1, round(_PARITY_SECONDS / main["timestep"])))
        main["parity"] = {
            **self.native.parity(mjb, run, horizon, module.name),
            "steps": run["steps"],
        }
        return reply

    def _version(self, lab: Lab, trial: Trial) -> Iterator[Diagnostic]:
        if trial.version != engine_version():
            message = f"the browser's engine is {trial.version}, native MuJoCo {engine_version()}"
            yield diagnose("lab-engine", lab.span.first_line(), message)


def _key(lab: Lab, module: LabModule, mjb: bytes) -> str:
    digest = hashlib.sha256(mjb)
    for part in (
        module.config,
        module.literal,
        f"{lab.verify_seconds}/{lab.verify_rtol}",
        engine_digest(),
        engine_version(),
    ):
        digest.update(f"\0{part}".encode())
    return digest.hexdigest()


def _parity(reply: dict[str, Any]) -> Parity | None:
    main = reply["main"]
    told = main["parity"] if main is not None else None
    if told is None or "first" not in told:
        return None
    return Parity(told["steps"], told["timestep"], told["first"], told["relative"])


def _result(
    owner: str,
    lab: Lab,
    module: LabModule,
    mjb: bytes,
    trial: Trial,
    parity: Parity | None,
    found: list[Diagnostic],
    seconds: float,
) -> LabResult:
    from coursebuild.labs.static import static_form

    main, speed = trial.main, trial.steps_per_second
    return LabResult(
        span=lab.span,
        name=module.name,
        lesson=owner,
        title=lab.title,
        status="failed" if found else "ok",
        seconds=seconds,
        steps_per_second=speed,
        tried=trial.tried,
        parity=parity.describe() if parity is not None else "",
        module=module.code,
        config=module.config,
        mjb=mjb,
        static=static_form(lab, main) if main is not None and not found else None,
    )


def _with_cached(result: LabResult, cached: bool) -> LabResult:
    from dataclasses import replace

    return replace(result, cached=cached)
