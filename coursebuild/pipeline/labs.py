"""Trying every lab of a course: models → V8 and native MuJoCo → results and diagnostics.

Entry point: `try_labs(course, models, options, engines)`.

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
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Self

from msgspec import Struct

from coursebuild.diagnostics import Diagnostic, diagnose
from coursebuild.effects.lab_engine import LabEngine
from coursebuild.effects.lab_files import engine_digest
from coursebuild.effects.mjcf import model_files
from coursebuild.effects.native import NativeEngine, NativeError, native_digest
from coursebuild.effects.versions import engine_version
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
from coursebuild.model import Course, Lab
from coursebuild.pipeline.custom_labs import custom_lab
from coursebuild.pipeline.lab_export import Offer, exported
from coursebuild.pipeline.lab_inputs import SECONDS, SIMULATED, lab_inputs, tried_data
from coursebuild.pipeline.lab_inputs import labs_of as labs_of
from coursebuild.pipeline.options import Options
from coursebuild.pipeline.remember import LabTrial, Memory
from coursebuild.pipeline.remember_models import need_of
from coursebuild.results import CompileResult, LabResult, StaticForm

_PARITY_SECONDS = 1.0
"""Simulated time over which the size of a difference counts, unless a lab says how much is allowed.
"""
_PASSING = ("timeout", "engine")
"""Kinds of failure that may not happen again, so that they are not kept."""


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
) -> tuple[tuple[LabResult, ...], tuple[Diagnostic, ...]]:
    """Try the labs, of all documents or of some, whose models compile; `engines` end with it.

    A lab of which something is in `wrong` already, such as a keyframe that is not there, is left.
    `static` forms are made when they are asked for; `only` names the labs to try.
    """
    results: list[LabResult] = []
    found: list[Diagnostic] = []
    memory = Memory(options.root, options.store)
    with engines:
        for owner, name, lab in labs_of(course):
            if documents is not None and lab.span.path not in documents:
                continue
            if only is not None and name not in only:
                continue
            if any(lab.span.contains(diagnostic.span) for diagnostic in wrong):
                continue
            if lab.kind != SIMULATED:
                save = functools.partial(_saved_model, memory, engines)
                result, diagnostics = custom_lab(
                    options.root, course, models, owner, name, lab, save
                )
                found += diagnostics
                results += [result] if result is not None else []
                continue
            source = _source(course, models, memory, lab)
            if source is None:
                continue
            attempt = _Attempt(options.root, memory, engines, course, owner, name, lab, source)
            result, diagnostics = attempt.run(static)
            found += diagnostics
            results.append(result)
    return tuple(results), tuple(found)


class _Source(Struct, frozen=True):
    """A lab's model as text."""

    path: str
    """Where it stands, or would."""
    text: str
    files: tuple[str, ...]
    """Other files that it may consist of."""


def _source(
    course: Course, models: Mapping[str, CompileResult], memory: Memory, lab: Lab
) -> _Source | None:
    """A lab's model; `None` for one that does not compile, as is told already."""
    if lab.xml is not None:
        text = lab.xml.text
        path = "models/.lab.xml"
        return _Source(path, text, model_files(memory.states.root, path, text))
    compiled = models.get(lab.model or "")
    if compiled is None or compiled.facts is None:
        return None
    source = next(model.source for model in course.models if model.name == lab.model)
    files = model_files(memory.states.root, source.path, source.text)
    return _Source(source.path, source.text, files)


def _saved_model(memory: Memory, engines: Engines, path: str, text: str) -> bytes:
    files = model_files(memory.states.root, path, text)
    return _saved(memory, engines, _Source(path, text, files))


def _saved(memory: Memory, engines: Engines, source: _Source) -> bytes:
    """A model as an MJB file, from the store where nothing that it is made of has changed."""
    needed = [need_of(file) for file in source.files]
    states = [memory.states(need) for need in needed]
    parts = json.dumps([engine_version(), source.path, source.text, source.files, states])
    key = hashlib.sha256(parts.encode()).hexdigest()
    made = memory.store.get("mjb", key)
    if made is None:
        made = engines.native.save(source.path, source.text)
        if states == [memory.states.now(need) for need in needed]:  # nobody saved one meanwhile
            memory.store.put("mjb", key, made)
    return made


class _Attempt(Struct, frozen=True):
    """Trying one lab."""

    root: Path
    memory: Memory
    engines: Engines
    course: Course
    owner: str
    name: str
    lab: Lab
    source: _Source

    def run(self, static: bool) -> tuple[LabResult, list[Diagnostic]]:
        """What became of it, and what is wrong."""
        began = time.monotonic()
        lab = self.lab
        module = compile_lab(lab, self.name)
        try:
            mjb = self._model()
            key = _key(lab, module, mjb)
            reply = self._stored(key)
            cached = reply is not None
            if reply is None:
                mistakes = self._mistakes()
                if mistakes:
                    return self._failed(module, began), mistakes
                reply = self._try(module, mjb, key)
        except NativeError as error:
            told = diagnose("lab-engine", entry_span(lab, ()), f"native MuJoCo {error}")
            return self._failed(module, began), [told]
        trial, parity = read_trial(reply), _parity(reply)
        seconds, made = _lasted(reply)
        found = [*trial_diagnostics(lab, trial), *self._version(trial)]
        found += shallow_diagnostics(lab, trial)
        if parity is not None:
            found += parity_diagnostics(lab, parity)
        form = self._static(key, trial) if static and not found else None
        offer = Offer(None) if found else self._export(trial, parity)
        own = () if self.lab.xml is not None else (self.source.path,)
        tried = LabTrial(not found, _is_kept(reply), seconds, made)
        self.memory.note_lab(lab_inputs(lab, self.name), (*own, *self.source.files), tried)
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
            seconds=time.monotonic() - began,
            steps_per_second=None,
            tried=(),
            parity="",
            module=module.code,
            config=module.config,
            mjb=b"",
            static=None,
        )

    def _model(self) -> bytes:
        """The model as an MJB file."""
        return _saved(self.memory, self.engines, self.source)

    def _mistakes(self) -> list[Diagnostic]:
        """What no engine could run."""
        code = pieces(self.lab)
        wrong = self.engines.browser.mistakes([_to_parse(piece) for piece in code])
        return [
            code_diagnostic(self.lab, piece, text)
            for piece, text in zip(code, wrong, strict=True)
            if text is not None
        ]

    def _stored(self, key: str) -> dict[str, Any] | None:
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
        if _is_kept(reply):
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

    def _export(self, trial: TrialReply, parity: Parity | None) -> Offer:
        """The script that does what the lab does."""
        if trial.main is None:
            return Offer(None)
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


def _lasted(reply: dict[str, Any]) -> tuple[float, int]:
    """How long a trial took, s, and when it was, in seconds since 1970."""
    return float(reply["seconds"]), int(reply["made"])


def _is_kept(reply: dict[str, Any]) -> bool:
    """Whether the same trial would have the same result another time."""
    return all(failure["kind"] not in _PASSING for failure in reply["failures"])


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
    told = main["parity"] if main is not None else None
    if told is None or "unrepeated" in told:
        return None
    return Parity(told["steps"], told["timestep"], told["first"], told["relative"], told["exact"])


def _parity_text(reply: dict[str, Any], parity: Parity | None, offer: Offer) -> str:
    if parity is not None:
        return parity.describe()
    told = reply["main"]["parity"] if reply["main"] is not None else None
    if told is None:
        return ""
    if offer.script is not None:
        return "compared with native MuJoCo as its Python export"
    return f"not compared with native MuJoCo: {told['unrepeated']}"
