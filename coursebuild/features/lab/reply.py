"""The reply of the browser's engine to a trial (see `trial.js`), and what is published of a trial.

Every published file has a hash of its content in its name, so that a browser may cache it for ever.
Addresses inside a lab's configuration are relative to it: all of its files lie in one folder.
"""

from __future__ import annotations

import base64
import json
import zlib
from typing import Annotated, Any, Literal, NotRequired, TypeAlias, TypedDict

import msgspec
from markupsafe import Markup
from msgspec import Meta, Struct

from coursebuild.api import Assets, OutputFile, PublishedTrials, Results
from coursebuild.core.pages.assets import hashed_name
from coursebuild.core.run.run_record import Moment
from coursebuild.features.lab.model import ODE, PLOT, Entry

_KINDS = {"f64": "<f8", "f32": "<f4", "i32": "<i4", "u32": "<u4", "u8": "u1"}
_LARGEST = 1 << 28
"""Bytes of the longest reply that is read."""
PARITY_RTOL = 1e-9
"""Relative difference allowed between the engines in the first second, unless a lab says."""

Count: TypeAlias = Annotated[int, Meta(ge=0, lt=1 << 53)]
Number: TypeAlias = int | float
Readouts: TypeAlias = list[Number | str | None]


class MainPicture(TypedDict):
    """What the lab shows at one moment of its main run."""

    time: Number
    frame: Any
    readouts: Readouts | None


class MainPlots(TypedDict):
    """What the plots of the lab show at the end."""

    times: list[Number]
    plots: list[list[list[Number | None]]]


class Parity(Struct, frozen=True, kw_only=True):
    """How closely native MuJoCo repeats the main run."""

    unrepeated: str = ""
    """Why it cannot; if set, the other fields mean nothing."""
    steps: Count = 0
    timestep: Number = 0
    """Seconds."""
    first: Count | None = None
    """The first step after which the states differ; `None`: bit-identical."""
    relative: Number = 0
    """Largest difference over the largest number of the state, in the steps that are compared."""
    exact: bool = False
    """Whether the model gives the same bits on every machine."""

    def tolerance(self, rtol: float | None) -> float:
        """The relative difference that is allowed: the lab's `rtol`, or the model's default."""
        if rtol is not None:
            return rtol
        return 0.0 if self.exact else PARITY_RTOL

    def is_within_tolerance(self, rtol: float | None) -> bool:
        """Whether the difference is allowed; a tolerance of 0 allows no difference at all."""
        tolerance = self.tolerance(rtol)
        return self.first is None or (tolerance > 0 and self.relative <= tolerance)

    def describe(self) -> tuple[str, dict[str, str]]:
        """The key of an interface text that describes the comparison, and its values."""
        if self.unrepeated:
            return "lab.parity.unrepeated", {"reason": self.unrepeated}
        steps = {"steps": str(self.steps)}
        if self.first is None:
            return "lab.parity.whole", steps
        steps["same"] = str(self.first - 1)
        if self.relative > 0:
            key = "lab.parity.within" if self.first > 1 else "lab.parity.close"
            return key, steps | {"difference": f"{self.relative:.0e}"}
        return "lab.parity.begun", steps


class MainRecord(TypedDict):
    """What the run of an exported script is compared with."""

    steps: Count
    last: Count
    """Checksum of the last state."""
    near: Count
    """The step whose state is recorded."""
    state: list[Number]


class ResetDifference(TypedDict):
    """What differs from the start after a reset, and the entry that should reset it."""

    what: str
    entry: Entry


class Fallen(TypedDict):
    """A body that has fallen out of the scene, and how high its top is at the end."""

    name: str
    height: Number
    time: Number


class MainRun(TypedDict):
    """What the main run recorded. Drawing it checks the parts typed `Any`."""

    steps: Count
    timestep: Number
    diverged: bool
    pictures: Annotated[list[MainPicture], Meta(min_length=1)]
    plots: MainPlots
    reach: NotRequired[list[tuple[Number, Number] | None]]
    scene: dict[str, Any]
    film: list[Any]
    arrows: dict[str, Number | str] | None
    fallen: NotRequired[list[Fallen]]
    fill: Number | None
    moved: Number | None
    parity: Parity | None
    recorded: NotRequired[MainRecord | None]
    resetDiffers: ResetDifference | None


class Attempt(Struct, frozen=True):
    """Something that a reader can do, and that the trial does."""

    description: str = msgspec.field(name="what", default="")


# fmt: off
FailureKind: TypeAlias = Literal[
    "throws", "nan", "type", "warning", "diverged", "deep",
    "expect", "goal", "stopAt", "timeout", "engine", "shared",
]
# fmt: on


class TrialFailure(Struct, frozen=True):
    """Something that went wrong in a trial."""

    entry: Entry
    kind: FailureKind
    message: str | None = None
    time: Number | None = msgspec.field(name="at", default=None)
    """Simulated time, s."""
    during: Attempt | None = None
    """The attempt in which it went wrong."""


class TrialReply(Struct, frozen=True):
    """A reply; `main` is `None` if the main run did not come to its end."""

    version: str
    attempts: tuple[Attempt, ...] = msgspec.field(name="tried")
    failures: tuple[TrialFailure, ...]
    main: MainRun | None
    seconds: Annotated[float, Meta(ge=0)] = 0.0
    timestamp: Moment = msgspec.field(name="made", default=0)
    steps_per_second: Count | None = msgspec.field(name="stepsPerSecond", default=None)

    @property
    def reach(self) -> list[tuple[Number, Number] | None]:
        """The least and the greatest value of each trace after Play; none where a run diverges."""
        return [] if self.main is None or self.main["diverged"] else self.main.get("reach", [])


def read_reply(data: bytes) -> TrialReply:
    """Read a reply from the bytes in which it is stored.

    Raises:
        ValueError, zlib.error: they hold no reply.
    """
    text = zlib.decompressobj().decompress(data, _LARGEST)  # if this cuts it, it is no JSON
    return msgspec.convert(json.loads(text), TrialReply)


def reply_bytes(reply: dict[str, Any]) -> bytes:
    """Return a reply as the bytes in which it is stored."""
    return zlib.compress(json.dumps(reply).encode())


def unpack_arrays(value: Any) -> Any:
    """Return a value with arrays in place of base64."""
    if isinstance(value, list):
        return [unpack_arrays(item) for item in value]
    if not isinstance(value, dict):
        return value
    if set(value) == {"type", "data"} and value["type"] in _KINDS:
        import numpy as np  # most replies that are read hold no array

        return np.frombuffer(base64.b64decode(value["data"]), _KINDS[value["type"]])
    return {key: unpack_arrays(item) for key, item in value.items()}


_FOLDER = "assets/labs"


class LabRecord(Struct, frozen=True):
    """What a page shows of a lab on paper, without JavaScript, and before the lab starts."""

    size: tuple[int, int]
    """Width and height of the picture, pixels."""
    scale: tuple[float, float] | None
    """Length of the bar that shows the picture's scale: in m, and in pixels. `None` for a lab
    without an engine, whose picture is that of its plots."""
    time: float
    """Simulated time of the picture, s."""
    readouts: tuple[tuple[str, str], ...]
    """Labels and values at the end of the main run."""
    end: float
    """Simulated time of the readouts and of the end of the plots, s."""
    plots: tuple[Markup, ...]
    place: str = ""
    """Where on the axis the readouts were taken, for a lab without an engine."""
    arrows: int = 0
    """How many buttons draw arrows in the live lab."""


class LabOutput(Struct, frozen=True):
    """What a page needs to show and run a lab."""

    module: str
    config: dict[str, Any]
    """The lab's data, as JSON has it."""
    mjb: bytes = b""
    record: LabRecord | None = None
    picture: bytes = b""
    """PNG on a transparent ground, if there is a record; SVG of a lab without an engine."""
    film: bytes = b""
    """Animated PNG, if the lab asks for one."""
    script: tuple[str, str] | None = None
    """Name and text of a Python script that does the same; `{{control:N}}` in it stands for the
    value of control N."""
    parity: tuple[str, dict[str, str]] = ("", {})
    source: str = ""
    """The model's MJCF, if a reader can edit it: it needs no other files."""


class PublishedLab(Struct, frozen=True):
    """A lab that pages can run."""

    name: str
    config: str
    """Site path, like `script`."""
    script: str
    """The script that runs on the page, the same for all labs."""
    record: LabRecord | None
    picture: str
    """Site path; empty if there is no record."""
    film: str
    """Site path; empty if there is none."""
    attempt_count: int
    parity: tuple[str, dict[str, str]]
    """The key of a text that says what agrees with another engine, and its values."""


def publish_labs(results: Results, assets: Assets) -> PublishedTrials:
    """Publish everything that the labs need."""
    if not results.trials:
        return PublishedTrials()
    files: dict[str, OutputFile] = {}

    def publish(name: str, data: bytes) -> str:
        path = hashed_name(f"{_FOLDER}/{name}", data)
        files[path] = OutputFile(path, data)
        return path

    def publish_model(name: str, text: str) -> str:
        path = publish(f"{name}.xml", text.encode())
        return path.removeprefix(f"{_FOLDER}/")

    trials = [(t.line, t.output) for t in results.trials if isinstance(t.output, LabOutput)]
    kinds = {lab.config.get("kind") in (PLOT, ODE) for _, lab in trials}
    if True in kinds:
        equation_script = publish("equations.js", assets.file("js/equation-lab.js"))
    if False in kinds:
        lab_script = publish("lab.js", assets.file("js/lab.js"))
        worker = publish("worker.js", assets.file("js/lab-worker.js"))
        wasm = publish("mujoco.wasm", assets.file("mujoco/mujoco.wasm"))
    sources = {lab.config.get("model"): lab.source for _, lab in trials if lab.source}
    labs = {}
    for line, lab in trials:
        name = line.name
        if lab.config.get("kind") in (PLOT, ODE):
            script, ending = equation_script, "svg"
            config = {key: value for key, value in lab.config.items() if key not in _CLAIMS}
        else:
            script, ending = lab_script, "png"
            # The page compiles a model that the reader edits, in a worker of its own; other labs of
            # the same model share its file.
            is_editable, model = "xml" in lab.config, lab.config.get("model") or name
            parts = {
                "module": publish(f"{name}.js", lab.module.encode()),
                "mjb": "" if is_editable else publish(f"{model}.mjb", lab.mjb),
                "worker": f"{worker}#{name}" if is_editable else worker,
                "wasm": wasm,
            }
            addresses = {key: path.removeprefix(f"{_FOLDER}/") for key, path in parts.items()}
            config = lab.config | addresses
            if lab.source:
                config["source"] = publish_model(model, lab.source)
            if starts := [name for name in lab.config.get("starts", ()) if name in sources]:
                config["starts"] = [
                    {"name": name.replace("_", " "), "source": publish_model(name, sources[name])}
                    for name in starts
                ]
            if lab.script is not None:
                config["exportPython"] = dict(zip(("name", "text"), lab.script, strict=True))
        picture = publish(f"{name}.{ending}", lab.picture) if lab.record is not None else ""
        film = publish(f"{name}-film.png", lab.film) if lab.film else ""
        data = json.dumps(config, ensure_ascii=False, separators=(",", ":")).encode()
        address = publish(f"{name}.json", data)
        labs[name] = PublishedLab(
            name, address, script, lab.record, picture, film, line.tried, lab.parity
        )
    return PublishedTrials(labs, tuple(files.values()))


_CLAIMS = ("expect", "verify")
"""Data of a lab without an engine that only its trial needs."""
