"""Trials of all labs of a course: models → V8 and native MuJoCo → results and diagnostics.

A lab's model is compiled natively, and the same bytes go to the browser's engine, which takes the
lab through everything that a reader can do with it. The main run and the exported script are
repeated natively and compared. Saved models, trials and pictures are stored by the hash of all that
they depend on, so that neither engine is started if nothing has changed.
"""

from __future__ import annotations

import functools
import json
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Self

import msgspec
from msgspec import Struct
from msgspec.structs import replace

from coursebuild.api import (
    Diagnostic,
    Source,
    Trial,
    TrialContext,
    TrialOutcome,
    TrialResult,
    diagnose,
    did_you_mean,
)
from coursebuild.core.files.errors import LackError
from coursebuild.core.files.read import read_bytes
from coursebuild.core.files.resources import template_texts
from coursebuild.core.model import Limits
from coursebuild.core.model.results import TrialLine
from coursebuild.core.pages.materials import strings_for
from coursebuild.core.run.child import LIMITS
from coursebuild.core.run.mjcf import model_files
from coursebuild.core.run.sandbox import Sandbox
from coursebuild.core.text.source import key_of
from coursebuild.core.values import fingerprint
from coursebuild.features.lab import verdict
from coursebuild.features.lab.compile import (
    LabModule,
    compile_lab,
    equation_inputs,
    inputs_of,
    pieces,
    trial_data,
)
from coursebuild.features.lab.course_models import files_of, find_model, save_model
from coursebuild.features.lab.engines.browser import LabEngine
from coursebuild.features.lab.engines.native import NativeEngine, NativeError, lab_digest
from coursebuild.features.lab.equations.equation_trial import (
    EquationEngine,
    EquationReply,
    add_points,
    run_trial,
)
from coursebuild.features.lab.export.script import LabExport, export_lab, record_for_export
from coursebuild.features.lab.model import BUILT_IN_KINDS, MJCF, ODE, PLOT, Lab
from coursebuild.features.lab.refusal import diagnose_refusal, diagnose_size
from coursebuild.features.lab.relations import is_editable
from coursebuild.features.lab.reply import LabOutput, TrialReply, read_reply, reply_bytes
from coursebuild.features.lab.schema import Camera

_PARITY_SECONDS = 1.0
"""Simulated time over which the size of a difference counts, unless a lab says how much is allowed.
"""
_TRANSIENT = ("timeout", "engine")
"""Kinds of failure that may not happen again: a trial that ends in one is not stored."""


class Engines:
    """The browser's engine and the native one; each starts when it is first needed."""

    def __init__(
        self,
        root: Path,
        limits: Limits = LIMITS,
        say: Callable[[str], None] = lambda _: None,
        sandbox: Sandbox | None = None,
    ) -> None:
        self.native = NativeEngine(
            root, memory=limits.memory, compiling=limits.models, say=say, sandbox=sandbox
        )
        self.browser = LabEngine(limits.memory)
        self.equations = EquationEngine(limits.memory)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        try:
            self.browser.close()
            self.equations.close()
        finally:
            self.native.__exit__(*error)

    def stop(self) -> None:
        """End what runs, and let nothing begin; called from another thread."""
        self.browser.stop()
        self.equations.stop()
        self.native.interrupt()


class LabTrials:
    """Trials of labs whose models compile; a lab that has diagnostics already is left out."""

    def __init__(
        self, context: TrialContext, engines: Engines | None = None, seconds: float | None = None
    ) -> None:
        """`seconds`: the processor time that a trial may take; by default, what the map says."""
        self._context = context
        self._seconds = seconds or context.course.limits.lab
        self._engines = engines or Engines(
            context.root, context.course.limits, context.say, context.sandbox
        )

    def run(self, trials: Sequence[Trial]) -> TrialOutcome:
        """Run the trials in turn, and end the engines."""
        results: list[TrialResult] = []
        diagnostics: list[Diagnostic] = []
        with self._engines:
            for trial in trials:
                try:
                    result, lab_diagnostics = self._try_lab(trial)
                except LackError as error:
                    if isinstance(trial.block, Lab) and trial.block.is_of_text:
                        raise
                    self._context.say(f"the pages of models have no labs: {error.message}")
                    break  # they come last
                results += () if result is None else (result,)
                diagnostics += lab_diagnostics
        return tuple(results), tuple(diagnostics)

    def stop(self) -> None:
        """End what runs, and let nothing begin; called from another thread."""
        self._engines.stop()

    def _try_lab(self, trial: Trial) -> tuple[TrialResult | None, list[Diagnostic]]:
        context, lab = self._context, trial.block
        assert isinstance(lab, Lab)
        if any(lab.span.contains(diagnostic.span) for diagnostic in context.diagnostics):
            return None, []
        if not (lab.is_of_text or context.static):
            return None, []  # it claims nothing, and no page is made of it
        if lab.kind not in BUILT_IN_KINDS:
            return self._publish_custom_lab(trial, lab)
        if lab.kind in (PLOT, ODE):
            return self._try_equations(trial, lab)
        if lab.xml is not None:
            model = Source("models/.lab.xml", lab.xml.text)
        elif (course_model := find_model(context, lab.fields.model or "")) is not None:
            model = course_model
        else:
            return None, []  # reported at the model or its name
        lab_trial = _LabTrial(context, self._engines, self._seconds, trial, lab, model)
        result, diagnostics = lab_trial.run()
        return result, diagnostics if lab.is_of_text else []

    def _try_equations(self, trial: Trial, lab: Lab) -> tuple[TrialResult | None, list[Diagnostic]]:
        inputs, runs, start = equation_inputs(lab, trial.name), self._context.run_store, time.time()
        config = json.loads(lab.config)
        missing = tuple(add_points(config, self._context.course))
        key = fingerprint((inputs.text, inputs.conditions, json.dumps(config["plots"])))
        decode = msgspec.json.Decoder(EquationReply).decode
        kept_reply = runs.store.get("labs", key, decode, shared=True)
        reply = kept_reply or run_trial(self._engines.equations, config, self._seconds)
        if kept_reply is None:
            seconds = round(time.time() - start, 4)
            reply = replace(reply, seconds=seconds, timestamp=int(start))
            if reply.lasting:
                runs.store.put("labs", key, msgspec.json.encode(reply), shared=True)
        runs.note_trial(
            inputs,
            (lab.span.path,) if any(plot["points"] for plot in config["plots"]) else (),
            ok=not reply.findings,
            lasting=reply.lasting,
            seconds=reply.seconds,
            timestamp=reply.timestamp,
        )
        reply = replace(reply, findings=(*missing, *reply.findings))
        line = TrialLine(
            name=trial.name,
            title=lab.fields.title,
            lesson=trial.owner,
            status="failed" if reply.findings else "ok",
            seconds=reply.seconds,
            tried=reply.tried,
            parity=_in_english(*reply.describe(lab.kind)),
            clipped=verdict.clipped_curves(lab, reply.reach),
            cached=kept_reply is not None,
        )
        output = LabOutput("", {"id": trial.name} | config, parity=reply.describe(lab.kind))
        if self._context.static and not reply.findings and reply.start is not None:
            from coursebuild.features.lab.picture.static import equation_record, plots_file

            decimal = decimal_of(self._context, trial)
            record = equation_record(lab, output.config, reply.start, decimal)
            output = replace(output, record=record, picture=plots_file(record.plots))
        findings = [finding.diagnostic(lab) for finding in reply.findings]
        return TrialResult(lab.span, line, output), findings

    def _publish_custom_lab(
        self, trial: Trial, lab: Lab
    ) -> tuple[TrialResult | None, list[Diagnostic]]:
        """Publish a lab of a course's own kind, of which only `content/labs/KIND.js` knows more.

        So there is no trial; but if its JSON has a `model`, it must exist and compile.
        """
        context, code, mjb = self._context, f"content/labs/{lab.kind}.js", b""
        if code not in context.course.files:
            return None, []  # reported at the kind
        data = json.loads(lab.config)
        if isinstance(name := data.get("model"), str):
            names = [model.name for model in context.course.models]
            if name not in names:
                message, help = f"no model `{name}` in models/", did_you_mean(name, names)
                return None, [diagnose("lab-model", lab.span.first_line(), message, help=help)]
            model = find_model(context, name)
            if model is None:
                return None, []  # reported at the model
            mjb = save_model(context, self._engines.native, model)
        module = read_bytes(context.root, code).decode("utf-8", "replace")
        config = {"id": trial.name, "kind": lab.kind, "title": lab.fields.title, "data": data}
        line = TrialLine(
            trial.name, lab.fields.title, trial.owner, "untried", untried="a kind of the course's"
        )
        return TrialResult(lab.span, line, LabOutput(module, config, mjb)), []


def _in_english(key: str, values: dict[str, str]) -> str:
    """A text of pages in the language of messages."""
    return strings_for(template_texts(), "en")(key, **values) if key else ""


def decimal_of(context: TrialContext, trial: Trial) -> str:
    """The sign before decimals on the page of a trial."""
    owner = next((o for o in context.course.owners if o.id == trial.owner), None)
    return context.course.words_of(owner).decimal[0]


class _Evaluation(Struct, frozen=True):
    reply: TrialReply
    failures: tuple[Diagnostic, ...]
    """Diagnostics with which the lab cannot be published."""
    remarks: tuple[Diagnostic, ...]
    """Diagnostics with which it can."""
    output: LabOutput
    """Without its model and its script."""


class _LabTrial(Struct, frozen=True):
    context: TrialContext
    engines: Engines
    seconds: float
    trial: Trial
    lab: Lab
    model: Source

    def run(self) -> tuple[TrialResult, list[Diagnostic]]:
        lab, store = self.lab, self.context.run_store.store
        module = compile_lab(lab, self.trial.name)
        inputs = inputs_of(lab, module)
        try:
            mjb = save_model(self.context, self.engines.native, self.model)
            if too_large := diagnose_size(lab, mjb, self.context.course.limits.memory):
                return self._fail(module, too_large)
            if assignments := list(verdict.assignment_diagnostics(lab)):
                return self._fail(module, assignments)
            key = fingerprint((inputs.text, inputs.conditions, mjb))
            evaluate = functools.partial(self._evaluate_reply, module, key)
            cached_evaluation = store.get("labs", key, evaluate, shared=True)
            if cached_evaluation is None and (diagnostics := self._check_code(mjb)):
                return self._fail(module, diagnostics)
            evaluation = cached_evaluation or evaluate(self._run_trial(module, mjb, key))
        except NativeError as error:
            refusals = diagnose_refusal(lab, self.context.root, self.model, str(error))
            diagnostic = diagnose("lab-engine", lab.place(()), f"native MuJoCo {error}")
            return self._fail(module, refusals or [diagnostic])
        reply, failures = evaluation.reply, evaluation.failures
        export = LabExport(None)
        is_exported = self.lab.kind != MJCF and not lab.of_exercise
        if not failures and reply.main is not None and is_exported:
            sources = files_of(self.context.root, self.model)
            native = self.engines.native
            export = export_lab(self.context, native, self.trial, lab, sources, reply.main)
        files = model_files(self.context.root, self.model.path, self.model.text)
        self.context.run_store.note_trial(
            inputs,
            (*((self.model.path,) if lab.xml is None else ()), *files),
            ok=not failures,
            lasting=_is_lasting(reply),
            seconds=reply.seconds,
            timestamp=reply.timestamp,
        )
        parity = None if reply.main is None else reply.main["parity"]
        comparison: tuple[str, dict[str, str]] = ("", {}) if parity is None else parity.describe()
        if parity is not None and parity.unrepeated and export.script is not None:
            comparison = "lab.parity.exported", {}
        share = None if lab.of_exercise or reply.main is None else reply.main["moved"]
        line = TrialLine(
            name=module.name,
            title=lab.fields.title,
            lesson=self.trial.owner,
            status="failed" if failures else "ok",
            seconds=reply.seconds,
            steps_per_second=reply.steps_per_second,
            tried=len(reply.attempts),
            parity=_in_english(*comparison),
            fill=None if reply.main is None else reply.main["fill"],
            play=verdict.play_text(share, lab.fields.still),
            fallen=verdict.fallen_bodies(reply),
            clipped=verdict.clipped_curves(lab, reply.reach),
            cached=cached_evaluation is not None,
            unexported=export.reason,
        )
        can_edit = lab.kind != MJCF and is_editable(self.model.text)  # that one is an editor
        source = self.model.text if can_edit else ""
        parts = {"mjb": mjb, "script": export.script, "parity": comparison, "source": source}
        output = replace(evaluation.output, **parts)
        return TrialResult(lab.span, line, output), [*failures, *evaluation.remarks]

    def _fail(
        self, module: LabModule, diagnostics: list[Diagnostic]
    ) -> tuple[TrialResult, list[Diagnostic]]:
        line = TrialLine(module.name, self.lab.fields.title, self.trial.owner, "failed")
        output = LabOutput(module.code, module.config)
        return TrialResult(self.lab.span, line, output), diagnostics

    def _evaluate_reply(self, module: LabModule, key: str, data: bytes) -> _Evaluation:
        """Evaluate a stored reply.

        Raises an exception if the bytes hold no reply: anybody can write to a shared store.
        """
        from coursebuild.features.lab.picture.static import lab_record

        lab, reply = self.lab, read_reply(data)
        if reply.main is None and not reply.failures:
            raise ValueError("a reply without a main run has a failure")
        failures: tuple[Diagnostic, ...] = ()
        if lab.is_of_text:
            messages = (failure.message or "" for failure in reply.failures)
            refusals = (
                diagnose_refusal(lab, self.context.root, self.model, message)
                for message in messages
            )
            refusal = next(filter(None, refusals), [])
            failures = tuple(refusal or verdict.failure_diagnostics(lab, reply))
        remarks, main = tuple(verdict.remark_diagnostics(lab, reply)), reply.main
        config = module.config
        if main is not None:
            # The camera that the trial worked out
            scene = main["scene"]
            camera = {name: scene["camera"][name] for name in Camera.__struct_fields__}
            framing = {"camera": camera, "floor": scene["floor"], "arrows": main["arrows"]}
            config = config | framing
            if "xml" in config:  # the reader may change the model to one that it does not suit
                config["extent"] = scene["extent"]
        output = LabOutput(module.code, config)
        if self.context.static and not failures and main is not None:
            from coursebuild.features.lab.picture.static import draw_film, draw_picture

            picture_key = key_of(key, str(self.lab.fields.height), lab_digest("picture"))
            keep = self.context.run_store.store.get_or_make
            picture = keep("pictures", picture_key, lambda: draw_picture(self.lab, main))
            film = b""
            if main["film"]:
                film = keep("films", picture_key, lambda: draw_film(self.lab, main))
            record = lab_record(lab, main, decimal_of(self.context, self.trial))
            output = replace(output, record=record, picture=picture, film=film)
        return _Evaluation(reply, failures, remarks, output)

    def _check_code(self, mjb: bytes) -> list[Diagnostic]:
        """Report code that no engine could run; if there is none, names that do not exist."""
        browser, code = self.engines.browser, tuple(pieces(self.lab))
        messages = browser.check_code(code)
        diagnostics = [
            verdict.code_diagnostic(self.lab, piece, message)
            for piece, message in zip(code, messages, strict=True)
            if message is not None
        ]
        if diagnostics:
            return diagnostics
        names = verdict.references(self.lab)
        replies = browser.look_up([name.path for name in names], mjb, self.seconds)
        unknown_names = verdict.name_diagnostics(names, replies)
        return [*unknown_names, *verdict.parameter_diagnostics(self.lab)]

    def _run_trial(self, module: LabModule, mjb: bytes, key: str) -> bytes:
        """Run the trial, and replace its recorded states by their comparison with a native run."""
        request = {
            "config": trial_data(module),
            "code": module.literal,
            "seconds": self.lab.verify.seconds,
        }
        start = time.monotonic()
        reply = self.engines.browser.trial(request, mjb, self.seconds)
        main = reply["main"]
        if main is not None and main["parity"] is not None:
            main["recorded"] = record_for_export(main["parity"], self._horizon(main))
            main["parity"] = self._compare_natively(main, mjb)
        reply["seconds"] = round(time.monotonic() - start, 4)
        reply["made"] = int(time.time())
        data = reply_bytes(reply)
        if _is_lasting(read_reply(data)):
            self.context.run_store.store.put("labs", key, data, shared=True)
        return data

    def _compare_natively(self, main: dict[str, Any], mjb: bytes) -> dict[str, Any]:
        run = main["parity"]
        if main["diverged"] and run["steps"]:
            run["steps"] -= 1  # the last state, which is not finite, may differ
        if run["steps"] == 0:
            return {"unrepeated": "it takes no step"}
        if run["modelChanged"]:
            return {"unrepeated": "its controller changes the model"}
        if not run["complete"]:
            return {"unrepeated": "its controller writes more than can be kept"}
        parity = self.engines.native.parity(mjb, run, self._horizon(main))
        return {**parity, "steps": run["steps"]}

    def _horizon(self, main: dict[str, Any]) -> int:
        """The step up to which the size of a difference counts."""
        steps = int(main["parity"]["steps"])
        if self.lab.verify.rtol is not None:
            return steps
        return min(steps, max(1, round(_PARITY_SECONDS / float(main["timestep"]))))


def _is_lasting(reply: TrialReply) -> bool:
    return all(failure.kind not in _TRANSIENT for failure in reply.failures)
