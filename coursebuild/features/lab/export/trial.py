"""The script that a lab's page offers, run natively and held against the lab's trial.

Entry points: `exported(…)`; `recorded(run, …)`, which keeps of a trial what is compared. A script
whose result is not that of the lab, or that fails for any value that the page may put into it, is
not offered.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from msgspec import Struct

from coursebuild.core.features import Trial, TrialContext
from coursebuild.core.model import Course
from coursebuild.core.run.versions import engine_version
from coursebuild.core.values import fingerprint
from coursebuild.features.lab.engines.files import lab_digest
from coursebuild.features.lab.engines.native import NativeEngine, NativeError
from coursebuild.features.lab.export.script import (
    ExportMetadata,
    export_script,
    file_name,
    filled,
    initial_values,
)
from coursebuild.features.lab.model import Lab
from coursebuild.features.lab.reply import PARITY_RTOL, MainRun, unpack_arrays
from coursebuild.features.lab.schema import Select, Slider

_SECONDS = 5.0
_MOST_STEPS = 20_000
"""How long a trial's main run is, unless the lab says so."""
_RELATIVE = 1e-9
_ABSOLUTE = 1e-12
"""How far readouts of the same state may be apart."""
_INFINITE: dict[Any, str] = {math.inf: "∞", -math.inf: "−∞"}
"""As the trial has them."""


class LabExport(Struct, frozen=True):
    """What a page offers to download, or why there is nothing."""

    script: tuple[str, str] | None
    """Name of the file and its text, with `{{control:N}}` for values of controls."""
    reason: str = ""


def exported(
    context: TrialContext,
    native: NativeEngine,
    trial: Trial,
    lab: Lab,
    main: MainRun,
) -> LabExport:
    """The script of a lab, from the store where the same was tried before.

    `main` is the main run of its trial.
    """
    metadata = ExportMetadata(
        file_name(trial.name),
        _origin(context.course, trial.owner),
        context.course.title,
        engine_version(),
        _seconds(lab, main),
    )
    # The model is in it by what the trial recorded.
    readouts = [picture["readouts"] for picture in main["pictures"]]
    code = lab_digest(".", "export/script.jinja")
    key = fingerprint((code, lab.config, metadata, main.get("recorded"), readouts))
    store = context.memory.store
    found = store.get_value("exports", key, LabExport)
    if found is not None:
        return found
    try:
        offer = _offered(context.root, native, lab, metadata, main)
    except NativeError as error:
        return LabExport(None, f"the script {error}")
    store.put_value("exports", key, offer)
    return offer


def _offered(
    root: Path,
    native: NativeEngine,
    lab: Lab,
    metadata: ExportMetadata,
    main: MainRun,
) -> LabExport:
    export = export_script(lab, metadata)
    if isinstance(export, str):
        return LabExport(None, export)
    if main["diverged"]:
        return LabExport(None, "its simulation diverges")
    kept = main.get("recorded")
    if kept is None:
        return LabExport(None, "the lab makes no step")
    request = {
        "path": str(root / "examples" / export.name),
        "text": filled(export, initial_values(lab)),
        "others": [filled(export, values) for values in _others(lab)],
        "buttons": list(export.buttons),
        "near": kept["near"],
    }
    run = native.script(request)
    if run["failure"]:
        return LabExport(None, f"the script fails: {run['failure']}")
    rtol = PARITY_RTOL if lab.verify.rtol is None else lab.verify.rtol
    reason = _difference(main, run, rtol)
    return LabExport(None, reason) if reason else LabExport((export.name, export.text))


def _origin(course: Course, owner: str) -> str:
    for lesson in course.lessons:
        if lesson.id == owner:
            return f"a lab of lesson {owner}, “{lesson.title}”"
    title = next((page.title for page in course.pages if page.id == owner), owner)
    return f"a lab of the page “{title}”"


def _seconds(lab: Lab, main: MainRun) -> float:
    """Simulated time of the main run."""
    stop = lab.fields.stopAt
    if lab.verify.seconds is not None:
        return lab.verify.seconds if stop is None else min(lab.verify.seconds, stop)
    seconds = _SECONDS if stop is None else stop
    if main["steps"] == _MOST_STEPS:
        seconds = min(seconds, round(float(main["steps"] * main["timestep"]), 9))
    return seconds


def _others(lab: Lab) -> list[dict[int, float | str]]:
    """Values of the controls that a reader can choose, each control for itself."""
    start = initial_values(lab)
    found = []
    for i, control in enumerate(lab.fields.controls):
        values: list[float | str] = []
        if isinstance(control, Slider):
            values = [control.min, control.max]
        elif isinstance(control, Select):
            values = [value for _, value in control.options]
        found += [{**start, i: value} for value in values if value != start[i]]
    return found


# --- what the script does, beside what the lab did


def recorded(run: dict[str, Any], horizon: int) -> dict[str, Any] | None:
    """What is kept of the main run of a trial, as JSON; `None` where no step was made.

    The state is the last one recorded before the step `horizon`, after which a difference in the
    last bit may have grown.
    """
    steps, stride, width = run["steps"], run["stride"], run["width"]
    if steps < stride:
        return None
    row = max(1, min(horizon, steps) // stride)
    states = unpack_arrays(run["states"])
    return {
        "steps": steps,
        "last": int(unpack_arrays(run["checksums"])[-1]),
        "near": row * stride,
        "state": states[(row - 1) * width : row * width].tolist(),
    }


def _difference(main: MainRun, run: dict[str, Any], rtol: float) -> str | None:
    """How a script's run differs from the main run of the trial, in words; `None` if it does not.

    The state that was recorded may be apart by `rtol`, relative to its largest number, which counts
    as at least 1. Where the end is the same to the last bit, its readouts are compared, too.
    """
    kept = main["recorded"]
    assert kept is not None, "where nothing was recorded, no script is offered"
    if run["steps"] != kept["steps"]:
        return f"it makes {run['steps']} steps, and the lab {kept['steps']}"
    apart = _apart(run["state"], kept["state"])
    if not apart <= rtol:
        return f"its state after {kept['near']} steps is apart from the lab's by {apart:.1e}"
    first, last = main["pictures"][0], main["pictures"][-1]
    found = _readouts(first["readouts"], run["start"], "start")
    if found is None and run["last"] == kept["last"]:
        found = _readouts(last["readouts"], run["end"], "end")
    return found


def _apart(mine: Sequence[float], theirs: Sequence[float]) -> float:
    if len(mine) != len(theirs):
        return math.inf
    largest = max([1.0, *(abs(x) for x in theirs)])
    return max([0.0, *(abs(a - b) / largest for a, b in zip(mine, theirs, strict=True))])


def _readouts(theirs: Any, mine: list[list[Any]], when: str) -> str | None:
    for (label, value), known in zip(mine, theirs or (), strict=False):
        if known is None:  # not a number, which is a gap
            continue
        value = _INFINITE.get(value, value)
        if isinstance(value, str) or isinstance(known, str):
            same = value == known
        else:
            same = math.isclose(value, known, rel_tol=_RELATIVE, abs_tol=_ABSOLUTE)
        if not same:
            return f"its readout `{label}` is {value} at the {when}, and that of the lab {known}"
    return None
