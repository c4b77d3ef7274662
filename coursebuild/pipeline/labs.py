"""Trying every lab of a course: models → V8 and native MuJoCo → results and diagnostics.

Entry points: `try_labs(course, models, options, engines)`; `run_scripts_and_labs`.

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
import hashlib
import json
import time
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, Self, TypeAlias, TypeVar

from msgspec import Struct

from coursebuild.core.model import Course, Lab
from coursebuild.core.model.results import CompileResult, LabResult, StaticForm
from coursebuild.core.run.lab_engine import LabEngine
from coursebuild.core.run.lab_files import engine_digest
from coursebuild.core.run.native import NativeEngine, NativeError, native_digest
from coursebuild.core.run.versions import engine_version
from coursebuild.core.text.diagnostics import Diagnostic, diagnose
from coursebuild.labs import export_check
from coursebuild.labs.compile import LabCode, LabModule, compile_lab, pieces
from coursebuild.labs.reply import TrialReply, read_trial
from coursebuild.labs.verdict import (
    Parity,
    code_diagnostic,
    deep_diagnostics,
    entry_span,
    parity_diagnostics,
    reset_diagnostics,
    shallow_diagnostics,
    trial_diagnostics,
)
from coursebuild.pipeline.custom_labs import custom_lab
from coursebuild.pipeline.lab_export import LabExport, exported
from coursebuild.pipeline.lab_inputs import SECONDS, SIMULATED, lab_inputs, tried_data
from coursebuild.pipeline.lab_inputs import labs_of as labs_of
from coursebuild.pipeline.lab_models import LabModel, model_of_lab, saved_model
from coursebuild.pipeline.options import Options
from coursebuild.pipeline.progress import Progress
from coursebuild.pipeline.remember import LabTrial, Memory

_PARITY_SECONDS = 1.0
"""Simulated time over which the size of a difference counts, unless a lab says how much is allowed.
"""
_TRANSIENT = ("timeout", "engine")
"""Kinds of failure that may not happen again: a trial that ends in one is not kept."""
T = TypeVar("T")
Tried: TypeAlias = tuple[tuple[LabResult, ...], tuple[Diagnostic, ...]]
"""What became of the labs, and what is wrong."""


class Engines:
    """The browser's engine and the native one; each is started when it is first needed."""

    def __init__(self, root: Path) -> None:
        self.native = NativeEngine(root)
        self.browser = LabEngine()

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


def try_labs(
    course: Course,
    models: Mapping[str, CompileResult],
    options: Options,
    engines: Engines,
    documents: frozenset[str] | None = None,
    wrong: Sequence[Diagnostic] = (),
    *,
    static: bool = False,
    only: frozenset[str] | None = None,
) -> Tried:
    """Try the labs, of all documents or of some, whose models compile; `engines` end with it.

    A lab of which something is in `wrong` already, such as a keyframe that is not there, is left.
    `static` forms are made when they are asked for; `only` names the labs to try.
    """
    results: list[LabResult | None] = []
    found: list[Diagnostic] = []
    root, memory = options.root, Memory(options.root, options.store)
    with engines:
        for owner, name, lab in labs_of(course):
            if documents is not None and lab.span.path not in documents:
                continue
            if only is not None and name not in only:
                continue
            if any(lab.span.contains(diagnostic.span) for diagnostic in wrong):
                continue
            if lab.kind != SIMULATED:
                result, diagnostics = custom_lab(
                    root, memory, engines.native, course, models, owner, name, lab
                )
            elif model := model_of_lab(root, course, models, lab):
                attempt = _Attempt(root, memory, engines, course, owner, name, lab, model)
                result, diagnostics = attempt.run(static)
            else:
                continue
            results.append(result)
            found += diagnostics
    return tuple(result for result in results if result is not None), tuple(found)


def run_scripts_and_labs(
    scripts: Callable[[], T], labs: Callable[[Engines], Tried], root: Path, progress: Progress
) -> tuple[T, Tried]:
    """What the scripts gave, and what the labs gave that were tried in a thread meanwhile."""
    engines = Engines(root)
    with ThreadPoolExecutor(1, "labs") as thread:
        trying = thread.submit(labs, engines)
        try:
            ran = scripts()
            with progress.stage("trying labs"):
                return ran, trying.result()
        except BaseException:  # Ctrl-C does not wait for a lab
            engines.stop()
            raise


class _Attempt(Struct, frozen=True):
    """Trying one lab."""

    root: Path
    memory: Memory
    engines: Engines
    course: Course
    owner: str
    name: str
    lab: Lab
    model: LabModel

    def run(self, static: bool) -> tuple[LabResult | None, list[Diagnostic]]:
        """What became of it, and what is wrong."""
        began = time.monotonic()
        lab = self.lab
        module = compile_lab(lab, self.name)
        try:
            mjb = saved_model(self.memory, self.engines.native, self.model)
            key = _key(lab, module, mjb)
            reply = self._load(key)
            cached = reply is not None
            if reply is None:
                mistakes = self._mistakes()
                if mistakes:
                    return self._failed(module, began), mistakes
                reply = self._try(module, mjb, key)
        except NativeError as error:
            wrong = diagnose("lab-engine", entry_span(lab, ()), f"native MuJoCo {error}")
            return self._failed(module, began), [wrong]
        trial, parity = read_trial(reply), _parity(reply)
        seconds, made = float(reply["seconds"]), int(reply["made"])
        found = [*trial_diagnostics(lab, trial), *self._version(trial)]
        found += shallow_diagnostics(lab, trial)
        if parity is not None:
            found += parity_diagnostics(lab, parity)
        form = self._static(key, trial) if static and not found else None
        offer = LabExport(None) if found else self._export(trial, parity)
        own = () if lab.xml is not None else (self.model.path,)
        tried = LabTrial(not found, _is_lasting(reply), seconds, made)
        self.memory.note_lab(lab_inputs(lab, self.name), (*own, *self.model.files), tried)
        result = LabResult(
            span=lab.span,
            name=module.name,
            lesson=self.owner,
            title=lab.title,
            status="failed" if found else "ok",
            seconds=seconds if cached else time.monotonic() - began,
            steps_per_second=trial.steps_per_second,
            tried=trial.tried,
            parity=_parity_text(reply, parity, offer),
            module=module.code,
            config=module.config,
            mjb=mjb,
            static=form,
            cached=cached,
            export=offer.script,
            unexported=offer.reason,
        )
        return result, [*found, *deep_diagnostics(lab, trial), *reset_diagnostics(lab, trial)]

    def _failed(self, module: LabModule, began: float) -> LabResult:
        """A lab that could not be tried."""
        return LabResult(
            span=self.lab.span,
            name=module.name,
            lesson=self.owner,
            title=self.lab.title,
            status="failed",
            module=module.code,
            config=module.config,
            seconds=time.monotonic() - began,
        )

    def _mistakes(self) -> list[Diagnostic]:
        """What no engine could run."""
        code = pieces(self.lab)
        wrong = self.engines.browser.mistakes([_to_parse(piece) for piece in code])
        return [
            code_diagnostic(self.lab, piece, text)
            for piece, text in zip(code, wrong, strict=True)
            if text is not None
        ]

    def _load(self, key: str) -> dict[str, Any] | None:
        """The reply of an earlier trial."""
        found = self.memory.store.get("labs", key)
        try:
            return None if found is None else json.loads(zlib.decompress(found))
        except (zlib.error, ValueError, RecursionError):
            return None

    def _try(self, module: LabModule, mjb: bytes, key: str) -> dict[str, Any]:
        """The reply of the trial, with the comparison in place of what it was made from."""
        request = {
            "config": tried_data(module),
            "code": module.literal,
            "seconds": self.lab.verify_seconds,
        }
        began = time.monotonic()
        reply = self.engines.browser.trial(request, mjb, SECONDS)
        main = reply["main"]
        if main is not None and main["parity"] is not None:
            main["recorded"] = export_check.recorded(main["parity"], self._horizon(main))
            main["parity"] = self._compared(main, mjb)
        reply["seconds"] = round(time.monotonic() - began, 4)
        reply["made"] = int(time.time())
        if _is_lasting(reply):
            self.memory.store.put("labs", key, zlib.compress(json.dumps(reply).encode()))
        return reply

    def _compared(self, main: dict[str, Any], mjb: bytes) -> dict[str, Any]:
        """How the main run compares with native MuJoCo, or why it cannot be repeated."""
        run = main["parity"]
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
        if self.lab.verify_rtol is not None:
            return steps
        return min(steps, max(1, round(_PARITY_SECONDS / float(main["timestep"]))))

    def _export(self, trial: TrialReply, parity: Parity | None) -> LabExport:
        """The script that does what the lab does."""
        if trial.main is None:
            return LabExport(None)
        lab = self.owner, self.name, self.lab
        return exported(
            self.memory.store, self.root, self.engines.native, self.course, lab, trial.main, parity
        )

    def _version(self, trial: TrialReply) -> Iterator[Diagnostic]:
        if trial.version != engine_version():
            message = f"the browser's engine is {trial.version}, native MuJoCo {engine_version()}"
            yield diagnose("lab-engine", self.lab.span.first_line(), message)

    def _static(self, key: str, trial: TrialReply) -> StaticForm | None:
        from coursebuild.labs.static import draw_picture, static_form

        lab, main = self.lab, trial.main
        if main is None:
            return None
        digest = hashlib.sha256(f"{key}\0{lab.height}\0{_drawing_digest()}".encode())

        def draw() -> bytes:
            return draw_picture(lab, main)

        return static_form(
            lab, main, self.memory.store.get_or_create("pictures", digest.hexdigest(), draw)
        )


def _is_lasting(reply: dict[str, Any]) -> bool:
    """Whether the same trial would have the same result another time."""
    return all(failure["kind"] not in _TRANSIENT for failure in reply["failures"])


def _to_parse(piece: LabCode) -> tuple[str, str, str, bool]:
    return piece.code, piece.form, piece.function, piece.takes_value


def _key(lab: Lab, module: LabModule, mjb: bytes) -> str:
    digest = hashlib.sha256(mjb)
    for part in (
        json.dumps(tried_data(module)),
        module.literal,
        f"{lab.verify_seconds}/{lab.verify_rtol is None}",
        engine_digest(),
        native_digest(),
        engine_version(),
    ):
        digest.update(f"\0{part}".encode())
    return digest.hexdigest()


@functools.lru_cache(maxsize=1)
def _drawing_digest() -> str:
    """A hash of how pictures are drawn."""
    from coursebuild import labs

    files = sorted(Path(labs.__file__ or "").parent.glob("*.py"))
    return hashlib.sha256(b"".join(file.read_bytes() for file in files)).hexdigest()


def _parity(reply: dict[str, Any]) -> Parity | None:
    main = reply["main"]
    run = main["parity"] if main is not None else None
    if run is None or "unrepeated" in run:
        return None
    return Parity(run["steps"], run["timestep"], run["first"], run["relative"], run["exact"])


def _parity_text(reply: dict[str, Any], parity: Parity | None, offer: LabExport) -> str:
    if parity is not None:
        return parity.describe()
    run = reply["main"]["parity"] if reply["main"] is not None else None
    if run is None:
        return ""
    if offer.script is not None:
        return "compared with native MuJoCo as its Python export"
    return f"not compared with native MuJoCo: {run['unrepeated']}"
