"""Measures a model file: its scenarios, its sweeps, and what it is made of.

The clock is the processor time of this thread: it stands still while others run.
"""

from __future__ import annotations

import atexit
import hashlib
import json
import re
import runpy
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal

import msgspec
import mujoco
import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from mjbench.declarations import (
    DeclarationError,
    Declarations,
    Place,
    parse_declarations,
)
from mjbench.derive import derive_seeds, derive_sweep
from mjbench.fair import fair_scenarios
from mjbench.host import Host
from mjbench.loop import Loop, LoopError, program_output
from mjbench.machine import one_processor, this_machine
from mjbench.problem import Array, Scenario, Setup
from mjbench.pruning.comparison import watch
from mjbench.pruning.reachability import possible_pairs
from mjbench.reports import PartFailure
from mjbench.reports.model_report import SceneCard, SceneReport
from mjbench.reports.scene_report import ScenarioReport, SweepReport
from mjbench.scene import ExactMotion, Scene, SceneError, element_names, scenes
from mjbench.simulation import silent, simulate
from mjbench.sweep import drawn_models, measure_sweep
from mjbench.work_precision import measure_scenario

EXACT_SECONDS = 20.0
"""Processor time that the file of an exact motion may take for one answer."""


class CannotMeasureError(Exception):
    """A model cannot be measured, or looked at; `place` is where the reason is."""

    def __init__(
        self,
        message: str,
        place: Place,
        help: str = "",
        cause: Literal["scenario", "model"] = "model",
    ) -> None:
        """`cause` says what is wrong: the model, or what is declared beside it."""
        super().__init__(message)
        self.cause = cause
        self.message = message
        self.place = place
        self.help = help


class Subject(Struct, frozen=True):
    """A model file with what lies beside it, as it is to be measured."""

    folder: str
    """Where all paths begin."""
    path: str
    """The model's file, POSIX."""
    mjcf: str
    """Its text."""
    name: str
    """What reports call the model."""
    digest: str
    """A hash of all that its figures depend on, for reports."""
    declarations_path: str = ""
    """The file of its declarations; empty without one."""
    declarations: str = ""
    """The text of that."""
    exact: str = ""
    """The file of its exact motion; empty without one."""
    parts: int = 0
    """The size of the files that the model pulls in, bytes."""
    fair: bool = False
    """Whether fair scenarios are made for a model without declared ones; else keyframes are."""

    @property
    def place(self) -> Place:
        """The model's file."""
        return Place(self.path)

    @property
    def is_fair(self) -> bool:
        """Whether its scenarios are fair ones, since nobody declares any."""
        return self.fair and not self.read_declarations().scenarios

    def read_declarations(self) -> Declarations:
        """The declarations; a `CannotMeasureError` where they cannot be read."""
        if not self.declarations_path:
            return Declarations(self.path)
        try:
            return parse_declarations(self.declarations_path, self.declarations)
        except DeclarationError as error:
            raise CannotMeasureError(
                str(error), Place(self.declarations_path), cause="scenario"
            ) from None

    @property
    def file(self) -> str:
        """The path of the model's file."""
        return str(Path(self.folder, self.path))

    @property
    def data(self) -> bytes:
        """The text of the model as its file has it."""
        return self.mjcf.encode("utf-8", "surrogateescape")

    @property
    def is_binary(self) -> bool:
        """Whether it is a compiled model, which has no source."""
        return self.path.endswith(".mjb")

    def compile(self) -> Any:
        """Its `mjModel`."""
        path = self.file
        if self.is_binary:
            return mujoco.MjModel.from_binary_path(path)
        return mujoco.MjModel.from_xml_path(path, assets={path: self.data})

    def read_spec(self) -> Any:
        """Its `MjSpec`; `None` where it has no source."""
        if not self.path.endswith(".urdf"):
            return None if self.is_binary else mujoco.MjSpec.from_file(self.file)
        # It may name files by other paths; where MuJoCo takes any bytes, its binding takes text.
        spec = mujoco.MjSpec.from_string(self.data.decode("utf-8", "replace"))
        spec.modelfiledir = self.folder
        return spec


class CompiledModel(Struct, frozen=True):
    """A model, compiled in this process, with its scenarios."""

    subject: Subject
    model: Any
    """An `mjModel`."""
    declarations: Declarations
    scenarios: tuple[Scene, ...]
    spec: Any
    """Its `mjSpec`, from which it can be compiled with other parameters; `None` without source."""


def compile_subject(
    subject: Subject, host: Host, *, quick: bool, loop: Loop | None = None, task: str = ""
) -> CompiledModel:
    """Compile a model and find its scenarios; a `CannotMeasureError` where it cannot be done.

    `loop`: the controller in all of them; sweeps have none, and are left out. `task`: the sensor,
    site or body whose reading or place counts besides coordinates.
    """
    declarations = subject.read_declarations()
    with report_errors(subject, "the model `{}` does not compile", ValueError):
        model = subject.compile()
    with report_errors(subject):
        if not model.opt.timestep > 0:
            raise SceneError(
                f"its timestep is {model.opt.timestep:g} s, and time goes forward", subject.place
            )
        if subject.is_fair:
            scenarios = fair_scenarios(model, subject.path, quick=quick, loop=loop)
            declarations = replace(declarations, scenarios=scenarios)
        if loop is not None:
            declarations = _under_control(declarations)
        if task:
            declarations = _with_task(model, declarations, task, loop)
        exact = _exact_motion(subject, host)
        found_scenes = scenes(model, declarations, quick=quick)
        found_scenes = tuple(
            replace(scene, exact=exact, scenario=replace(scene.scenario, loop=loop))
            for scene in found_scenes
        )
        return CompiledModel(subject, model, declarations, found_scenes, subject.read_spec())


def _under_control(declarations: Declarations) -> Declarations:
    """What is declared of a model that a controller commands."""
    for scenario in declarations.scenarios:
        if scenario.controls:
            message = "it has commands of its own, and a controller is to give them"
            raise SceneError(message, scenario.place("controls"))
    return replace(declarations, sweeps=())


def _with_task(
    model: Any, declarations: Declarations, task: str, loop: Loop | None
) -> Declarations:
    prefix, _, name = task.rpartition(":")
    kinds = (kind for kind in ("sensor", "site", "body") if prefix in ("", kind))
    kind = next((kind for kind in kinds if name in element_names(model, kind)), None)
    if kind is None:
        raise SceneError(f"the model has no sensor, site or body `{task}`")
    needs_commands = int(mujoco.mjtStage.mjSTAGE_ACC)
    if loop and kind == "sensor" and model.sensor(name).needstage[0] == needs_commands:
        raise SceneError(
            f"the sensor `{name}` reads what commands do, which are not kept of a controller",
            help="measure a place or a velocity",
        )
    scenarios = [replace(s, measure=f"{kind}:{name}") for s in declarations.scenarios]
    return replace(declarations, scenarios=tuple(scenarios))


def run_scenario(
    compiled_model: CompiledModel,
    number: int,
    host: Host,
    *,
    quick: bool,
    timed: bool,
    profile: bool = False,
) -> ScenarioReport:
    """Measure a scenario, given by its number; a `CannotMeasureError` where it cannot be done.

    `profile`: whether to say where the time goes.
    """
    clock = time.thread_time_ns if timed else None
    with report_errors(compiled_model.subject), one_processor():
        scene, spec = compiled_model.scenarios[number], compiled_model.spec
        if scene.declaration.draw and spec is None:
            message = "a compiled model has no parameters to draw"
            raise SceneError(message, scene.declaration.place("draw"))
        if scene.scenario.loop is not None:
            _check_repeats(compiled_model.model, scene.scenario, scene.scenario.loop)
        return measure_scenario(
            compiled_model.model,
            scene,
            drawn_models(spec, scene.declaration),
            quick=quick,
            clock=clock,
            tell=host.tell,
            profile=profile,
        )


def _check_repeats(model: Any, scenario: Scenario, loop: Loop) -> None:
    """A `LoopError` where a controller makes another motion of the same simulation."""
    runs = [simulate(Setup(scenario=scenario), model).states for _ in range(2)]
    if not np.array_equal(runs[0].qpos, runs[1].qpos, equal_nan=True):
        message = f"{loop.path} commands another motion each time it is run"
        raise LoopError(f"{message}: seed what is random in it, where its file begins")


def run_sweep(
    compiled_model: CompiledModel, name: str, host: Host, *, quick: bool, timed: bool
) -> SweepReport:
    """Measure a sweep; a `CannotMeasureError` if it cannot be done."""
    host.tell(name)
    sweep = next(sweep for sweep in compiled_model.declarations.sweeps if sweep.name == name)
    clock = time.thread_time_ns if timed else None
    scenario = next(s for s in compiled_model.scenarios if sweep.scenario in (None, s.name))
    with report_errors(compiled_model.subject), one_processor():
        if compiled_model.spec is None:
            raise SceneError(
                "a compiled model has no parameters to sweep", sweep.variations[0].place
            )
        return measure_sweep(compiled_model.spec, scenario, sweep, clock, quick=quick)


def join_parts(
    compiled_model: CompiledModel,
    scenarios: Sequence[ScenarioReport],
    sweeps: Sequence[SweepReport],
    host: Host,
    *,
    quick: bool,
    card: bool = False,
    failures: Sequence[PartFailure] = (),
) -> SceneReport:
    """The report on a model of what was measured of it; with `card`, also what it is made of.

    `failures`: what was not measured.
    """
    if compiled_model.subject.is_fair:
        names = [scenario.name for scenario in compiled_model.scenarios]
        scenarios = derive_seeds(scenarios, names)
    report = SceneReport(
        model=compiled_model.subject.name,
        digest=compiled_model.subject.digest,
        quick=quick,
        machine=this_machine(pinned=True),
        scenarios=tuple(scenarios),
        sweeps=tuple(map(derive_sweep, sweeps)),
        failures=tuple(failures),
    )
    return replace(report, card=_card(compiled_model, host)) if card and scenarios else report


@contextmanager
def report_errors(
    subject: Subject, failure: str = "the model `{}` cannot be measured", *errors: type[Exception]
) -> Iterator[None]:
    """Turn errors into a `CannotMeasureError` with their places, and silence MuJoCo's warnings.

    `failure` says what is not possible because of one of `errors`, or of what MuJoCo refuses to
    run, such as a model that asks for less memory than it needs.
    """
    try:
        with silent():
            yield
    except SceneError as error:
        place = error.place or Place(subject.declarations_path or subject.path)
        raise CannotMeasureError(error.message, place, error.help, "scenario") from None
    except LoopError as error:
        raise CannotMeasureError(str(error), subject.place) from None
    except (mujoco.FatalError, UnicodeDecodeError, *errors) as error:
        message = f"{failure.format(subject.name)}: {' '.join(str(error).split())}"
        raise CannotMeasureError(message, subject.place) from None


def _exact_motion(subject: Subject, host: Host) -> ExactMotion | None:
    """The exact motion, if there is code for it, which runs in a process of its own."""
    path = subject.exact
    if not path:
        return None

    def states(times: Array, qpos: Array, qvel: Array) -> tuple[Array, Array | None]:
        query = {"times": times.tolist(), "qpos": qpos.tolist(), "qvel": qvel.tolist()}
        run = host.run_exact(path, json.dumps(query), EXACT_SECONDS)
        try:
            rows = msgspec.json.decode(run.output, type=list[list[list[float]]])
            positions, *rest = (np.array(part) for part in zip(*rows, strict=True))
        except (msgspec.DecodeError, ValueError):
            reason = run.failure
            if not reason:
                reason = "its numbers of coordinates change" if run.output else "it exits"
            message = f"`{path}` gives no motion: {reason}"
            help = "define `motion(time, qpos, qvel)` there, for the positions at a time in s"
            raise SceneError(message, Place(path), help) from None
        return positions, rest[0] if rest else None

    return ExactMotion(path, states)


def _card(compiled_model: CompiledModel, host: Host) -> SceneCard:
    """What a model is made of; how fast it runs in a browser is for the host to say."""
    subject, model = compiled_model.subject, compiled_model.model
    with silent():  # MuJoCo would write its warnings into the working directory
        touching_pairs = {
            pair
            for scene in compiled_model.scenarios
            for pair in watch(model, scene).touching_pairs
        }
    first = compiled_model.scenarios[0].scenario
    key = None if first.keyframe < 0 else first.keyframe
    return SceneCard(
        possible=len(possible_pairs(model)),
        touched=len(touching_pairs),
        mjcf=len(subject.data) + subject.parts,
        mjb=int(mujoco.mj_sizeModel(model)),
        browser=host.browser_speed(key, first.duration),
    )


class UsageError(Exception):
    """The command cannot be done as it is given."""


def read_subject(file: Path) -> Subject:
    """A model file, with the declarations and the exact motion that lie beside it."""
    if not file.is_file():
        raise UsageError(f"there is no file {file}")
    if file.suffix == ".py":
        return _subject_of_python(file)
    folder, data = file.parent.resolve(), file.read_bytes()
    declarations, exact = file.with_suffix(".toml"), file.with_suffix(".exact.py")
    digest = hashlib.sha256(data)
    for file_beside in (declarations, exact):
        if file_beside.is_file():
            digest.update(file_beside.read_bytes())
    for part in _dependencies(folder / file.name) if file.suffix == ".xml" else ():
        if part.exists() and not part.samefile(file):
            digest.update(part.read_bytes())
    return Subject(
        folder=str(folder),
        path=file.name,
        mjcf="" if file.suffix == ".mjb" else _source(file, data),
        name=file.stem,
        digest=digest.hexdigest(),
        declarations_path=declarations.name if declarations.is_file() else "",
        declarations=declarations.read_text("utf-8", "replace") if declarations.is_file() else "",
        exact=exact.name if exact.is_file() else "",
        fair=True,
    )


def _source(file: Path, data: bytes) -> str:
    """The text of a model; in URDF, packages are the folders of their names beside it or above."""

    def folder(match: re.Match[str]) -> str:
        for parent in file.resolve().parents:
            if (parent / match[1]).is_dir():
                return f"{parent.as_posix()}/{match[1]}/"
        message = f"{file} takes files from the package `{match[1]}`, and no folder of that name"
        raise UsageError(f"{message} lies beside it or above it: put the package there")

    text = data.decode("utf-8", "surrogateescape")  # MuJoCo reads comments in any encoding
    return re.sub(r"package://([^/\s\"'<>]+)/", folder, text) if file.suffix == ".urdf" else text


def _dependencies(file: Path) -> list[Path]:
    """The files that a MJCF pulls in; none where it cannot be read, which compiling it tells."""
    try:
        return [Path(path) for path in mujoco.mju_getXMLDependencies(str(file))]
    except mujoco.FatalError:
        return []


def _subject_of_python(file: Path) -> Subject:
    """The model that a program makes: its `spec` or `model`, or what a function so called gives."""
    try:
        with program_output():
            names = runpy.run_path(str(file))
            product = names.get("spec", names.get("model"))
            product = product() if callable(product) else product
        if isinstance(product, mujoco.MjSpec):
            product = product.compile()
    except (Exception, SystemExit) as error:
        reason = " ".join(f"{type(error).__name__}: {error}".split())
        raise UsageError(f"{file} fails: {reason}") from error
    if not isinstance(product, mujoco.MjModel):
        raise UsageError(f"{file} defines no `spec` or `model` of MuJoCo's")
    folder = tempfile.TemporaryDirectory(prefix="mjbench-")
    atexit.register(folder.cleanup)
    binary = Path(folder.name, f"{file.stem}.mjb")
    mujoco.mj_saveModel(product, str(binary))
    table = file.with_suffix(".toml")
    if table.is_file():
        binary.with_suffix(".toml").write_bytes(table.read_bytes())
    return read_subject(binary)
