"""The reply of a trial, read: plain values with arrays.

Entry point: `read_trial(reply)`. docs/explanation/how-labs-run.md says what a reply holds.
"""

from __future__ import annotations

import base64
from typing import Any

from msgspec import Struct

from coursebuild.features.lab.model import Entry

_KINDS = {"f64": "<f8", "f32": "<f4", "i32": "<i4", "u32": "<u4", "u8": "u1"}


class TrialFailure(Struct, frozen=True):
    """Something that went wrong in a trial."""

    entry: Entry
    kind: str
    """`throws`, `nan`, `type`, `warning`, `diverged`, `deep`, `expect`, `goal`, `stopAt`,
    `timeout`, `engine` or `shared`."""
    message: str
    time: float | None
    """Simulated time, s."""
    during: str
    """What was being tried."""


class TrialReply(Struct, frozen=True):
    """A reply. `main` is what the main run recorded, `None` where it did not come to its end."""

    version: str
    tried: tuple[str, ...]
    failures: tuple[TrialFailure, ...]
    main: dict[str, Any] | None
    steps_per_second: int | None


def read_trial(reply: dict[str, Any]) -> TrialReply:
    """A reply of the trial's JavaScript."""
    failures = tuple(
        TrialFailure(
            tuple(failure["entry"]),
            failure["kind"],
            failure.get("message") or "something that has no text",
            failure["at"],
            (failure.get("during") or {}).get("what", ""),
        )
        for failure in reply["failures"]
    )
    tried = tuple(step["what"] for step in reply["tried"])
    speed = reply.get("stepsPerSecond")
    return TrialReply(reply["version"], tried, failures, reply["main"], speed)


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
