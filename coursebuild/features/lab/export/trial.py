"""Runs the script that a lab's page offers, and compares it with the lab's trial.

Entry points: `export_lab(…)`; `record_for_export(run, …)`, which records of a trial what is
compared. A script is not offered if its result differs from the lab's, or if it fails for any value
that the page may fill in.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from msgspec import Struct

from coursebuild.core.features import Trial, TrialContext
from coursebuild.core.model import Course
from coursebuild.core.values import fingerprint
from coursebuild.features.lab.engines.native import (
    LAB_ENGINE,
    NativeEngine,
    NativeError,
    lab_digest,
)
from coursebuild.features.lab.export.script import (
    ExportMetadata,
    export_script,
    file_name,
    fill_in_values,
    initial_values,
)
from coursebuild.features.lab.model import Lab
from coursebuild.features.lab.reply import PARITY_RTOL, MainRun, unpack_arrays
from coursebuild.features.lab.schema import Select, Slider

_RELATIVE = 1e-9
_ABSOLUTE = 1e-12
"""Tolerances of readouts of the same state."""
_INFINITE: dict[Any, str] = {math.inf: "∞", -math.inf: "−∞"}
"""Infinite values as a trial's reply writes them."""


class LabExport(Struct, frozen=True):
    """The script that a page offers to download, or why there is none."""

    script: tuple[str, str] | None
    """Name and text of the file, with `{{control:N}}` for values of controls."""
    reason: str = ""


def export_lab(
    context: TrialContext,
    native: NativeEngine,
    trial: Trial,
    lab: Lab,
    main: MainRun,
) -> LabExport:
    """Write and try the script of a lab, or take it from the store.

    `main` is the main run of the lab's trial.
    """
    start, end = (main["pictures"][i]["time"] for i in (0, -1))
    metadata = ExportMetadata(
        file_name(trial.name),
        _origin(context.course, trial.owner),
        context.course.title,
        LAB_ENGINE,
        round(end - start, 9),
    )
    # The record stands for the model: a change that matters changes it, too.
    readouts = [picture["readouts"] for picture in main["pictures"]]
    code = lab_digest(".", "export/script.jinja")
    key = fingerprint((code, lab.config, metadata, main.get("recorded"), readouts))
    store = context.run_store.store
    export = store.get_value("exports", key, LabExport)
    if export is not None:
        return export
    try:
        export = _try_export(context.root, native, lab, metadata, main)
    except NativeError as error:
        return LabExport(None, f"the script {error}")
    store.put_value("exports", key, export)
    return export


def _try_export(
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
    record = main.get("recorded")
    if record is None:
        return LabExport(None, "the lab makes no step")
    request = {
        "path": str(root / "examples" / export.name),
        "text": fill_in_values(export, initial_values(lab)),
        "variants": [fill_in_values(export, values) for values in _control_variants(lab)],
        "buttons": list(export.buttons),
        "near": record["near"],
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


def _control_variants(lab: Lab) -> list[dict[int, float | str]]:
    """List values of all controls, with a single one at another value than at the start."""
    start = initial_values(lab)
    variants = []
    for i, control in enumerate(lab.fields.controls):
        values: list[float | str] = []
        if isinstance(control, Slider):
            values = [control.min, control.max]
        elif isinstance(control, Select):
            values = [value for _, value in control.options]
        variants += [{**start, i: value} for value in values if value != start[i]]
    return variants


# --- the script's run compared with the lab's


def record_for_export(run: dict[str, Any], horizon: int) -> dict[str, Any] | None:
    """Record of a trial's main run what scripts are compared with; `None` if it made no step.

    The state is the last one recorded up to the step `horizon`: later, a difference in the last bit
    may have grown.
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
    """Say how a script's run differs from the main run of the trial; `None` if it does not.

    The states may differ by `rtol`, relative to the largest number, or to 1 if that is larger. If
    the last states are the same to the bit, the readouts there are compared, too.
    """
    record = main["recorded"]
    assert record is not None, "without a record no script is tried"
    if run["steps"] != record["steps"]:
        return f"it makes {run['steps']} steps, and the lab {record['steps']}"
    difference = _relative_difference(run["state"], record["state"])
    if not difference <= rtol:
        return f"its state after {record['near']} steps is apart from the lab's by {difference:.1e}"
    first, last = main["pictures"][0], main["pictures"][-1]
    reason = _compare_readouts(first["readouts"], run["start"], "start")
    if reason is None and run["last"] == record["last"]:
        reason = _compare_readouts(last["readouts"], run["end"], "end")
    return reason


def _relative_difference(state: Sequence[float], lab_state: Sequence[float]) -> float:
    if len(state) != len(lab_state):
        return math.inf
    largest = max([1.0, *(abs(x) for x in lab_state)])
    return max([0.0, *(abs(a - b) / largest for a, b in zip(state, lab_state, strict=True))])


def _compare_readouts(lab_values: Any, readouts: list[list[Any]], moment: str) -> str | None:
    for (label, value), lab_value in zip(readouts, lab_values or (), strict=False):
        if lab_value is None:  # it is not a number, and the lab shows nothing
            continue
        value = _INFINITE.get(value, value)
        if isinstance(value, str) or isinstance(lab_value, str):
            is_same = value == lab_value
        else:
            is_same = math.isclose(value, lab_value, rel_tol=_RELATIVE, abs_tol=_ABSOLUTE)
        if not is_same:
            lab_readout = f"that of the lab {lab_value}"
            return f"its readout `{label}` is {value} at the {moment}, and {lab_readout}"
    return None
