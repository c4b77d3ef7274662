"""What an engine replies when it has tried a lab.

Entry points: `read_reply`, `reply_bytes`; `Parity`; `unpack_arrays`, of arrays that are base64 in a
reply. docs/explanation/how-labs-run.md says what a reply means.
"""

from __future__ import annotations

import base64
import json
import zlib
from typing import Annotated, Any, NotRequired, TypeAlias, TypedDict

import msgspec
from msgspec import Meta, Struct

from coursebuild.core.run.run_record import Moment
from coursebuild.features.lab.model import Entry

_KINDS = {"f64": "<f8", "f32": "<f4", "i32": "<i4", "u32": "<u4", "u8": "u1"}
_LARGEST = 1 << 28
"""Bytes of a reply."""
PARITY_RTOL = 1e-9
"""How far (relative) the two engines may be apart over the first second, unless a lab says."""

Count: TypeAlias = Annotated[int, Meta(ge=0, lt=1 << 53)]
Number: TypeAlias = int | float
Readouts: TypeAlias = list[Number | str | None]


class MainPicture(TypedDict):
    """What the lab shows at one moment of its main run."""

    time: Number
    frame: Any
    readouts: Readouts | None


class MainPlots(TypedDict):
    """What its plots show at the end."""

    times: list[Number]
    plots: list[list[list[Number | None]]]


class Parity(Struct, frozen=True, kw_only=True):
    """How native MuJoCo repeats it."""

    unrepeated: str = ""
    """Why it cannot; then all else says nothing."""
    steps: Count = 0
    timestep: Number = 0
    """s."""
    first: Count | None = None
    """The first step after which the states differ; `None`: bit-identical."""
    relative: Number = 0
    """Largest difference relative to the largest number of the state, where it counts."""
    exact: bool = False
    """Whether nothing in the model can differ between two machines, not even in the last bit."""

    def allowed(self, rtol: float | None) -> float:
        """The relative difference that is allowed: the lab's own, or what its model may have."""
        if rtol is not None:
            return rtol
        return 0.0 if self.exact else PARITY_RTOL

    def within(self, rtol: float | None) -> bool:
        """Whether the difference is allowed; one of 0 allows none of any size."""
        allowed = self.allowed(rtol)
        return self.first is None or (allowed > 0 and self.relative <= allowed)

    def describe(self) -> str:
        """For people."""
        if self.unrepeated:
            return f"not compared with native MuJoCo: {self.unrepeated}"
        if self.first is None:
            return f"bit-identical to native MuJoCo over {self.steps} steps"
        same = f"bit-identical to native MuJoCo for {self.first - 1} of {self.steps} steps"
        return f"{same}, then within {self.relative:.0e}" if self.relative > 0 else same


class MainRecord(TypedDict):
    """What an exported script is held against."""

    steps: Count
    last: Count
    near: Count
    state: list[Number]


class ResetDifference(TypedDict):
    """What a reset does not lead back to the start, and the entry that should."""

    what: str
    entry: Entry


class MainRun(TypedDict):
    """What the main run recorded. What is drawn of it is checked by drawing it."""

    steps: Count
    timestep: Number
    diverged: bool
    pictures: Annotated[list[MainPicture], Meta(min_length=1)]
    plots: MainPlots
    scene: dict[str, Any]
    arrows: dict[str, Number | str] | None
    fill: Number | None
    mostFill: Number | None
    parity: Parity | None
    recorded: NotRequired[MainRecord | None]
    resetDiffers: ResetDifference | None


class Attempt(Struct, frozen=True):
    """Something that a reader can do."""

    what: str = ""


FailureKind: TypeAlias = Annotated[
    str,
    Meta(
        pattern="^(throws|nan|type|warning|diverged|deep|expect|goal|stopAt|timeout|engine|shared)$"
    ),
]


class TrialFailure(Struct, frozen=True):
    """Something that went wrong in a trial."""

    entry: Entry
    kind: FailureKind
    message: str | None = None
    time: Number | None = msgspec.field(name="at", default=None)
    """Simulated time, s."""
    during: Attempt | None = None
    """What was being tried."""


class TrialReply(Struct, frozen=True):
    """A reply. `main` is what the main run recorded, `None` where it did not come to its end."""

    version: str
    tried: tuple[Attempt, ...]
    failures: tuple[TrialFailure, ...]
    main: MainRun | None
    seconds: Annotated[float, Meta(ge=0)] = 0.0
    """How long the trial took."""
    made: Moment = 0
    steps_per_second: Count | None = msgspec.field(name="stepsPerSecond", default=None)


def read_reply(data: bytes) -> TrialReply:
    """The reply that was kept as bytes.

    Raises:
        ValueError, zlib.error: they hold none.
    """
    text = zlib.decompressobj().decompress(data, _LARGEST)  # which is no JSON where it is cut
    return msgspec.convert(json.loads(text), TrialReply)


def reply_bytes(reply: dict[str, Any]) -> bytes:
    """A reply as it is kept."""
    return zlib.compress(json.dumps(reply).encode())


def unpack_arrays(value: Any) -> Any:
    """The value with arrays in place of base64."""
    if isinstance(value, list):
        return [unpack_arrays(item) for item in value]
    if not isinstance(value, dict):
        return value
    if set(value) == {"type", "data"} and value["type"] in _KINDS:
        import numpy as np  # most replies that are read hold no array

        return np.frombuffer(base64.b64decode(value["data"]), _KINDS[value["type"]])
    return {key: unpack_arrays(item) for key, item in value.items()}
