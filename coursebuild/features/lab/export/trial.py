"""The script that a lab's page offers, run natively and held against the lab's trial.

Entry point: `exported(…)`. A script whose result is not that of the lab, or that fails for any
value that the page may put into it, is not offered.
"""

from __future__ import annotations

import functools
import hashlib
import json
from pathlib import Path
from typing import Any

from msgspec import Struct

from coursebuild.core.features import Trial, TrialContext
from coursebuild.core.model import Course
from coursebuild.core.run.versions import engine_version
from coursebuild.features.lab.engines.native import NativeEngine, NativeError
from coursebuild.features.lab.export import difference as export_check
from coursebuild.features.lab.export.script import (
    Export,
    export_script,
    file_name,
    filled,
    initial_values,
)
from coursebuild.features.lab.export.text import ExportMetadata
from coursebuild.features.lab.model import Lab
from coursebuild.features.lab.schema import Select, Slider
from coursebuild.features.lab.verdict import PARITY_RTOL, Parity

_SECONDS = 5.0
_MOST_STEPS = 20_000
"""How long a trial's main run is, unless the lab says so."""


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
    main: dict[str, Any],
    parity: Parity | None,
) -> LabExport:
    """The script of a lab.

    `main` is the main run of its trial, `parity` how that compares with native MuJoCo.
    """
    course = context.course
    metadata = ExportMetadata(
        file_name(trial.name),
        _origin(course, trial.owner),
        course.title,
        engine_version(),
        _seconds(lab, main),
    )
    export = export_script(lab, metadata)
    if isinstance(export, str):
        return LabExport(None, export)
    if main["diverged"]:
        return LabExport(None, "its simulation diverges")
    if main.get("recorded") is None:
        return LabExport(None, "the lab makes no step")
    reason = _checked(context, native, lab, export, main, parity)
    return LabExport(None, reason) if reason else LabExport((export.name, export.text))


def _origin(course: Course, owner: str) -> str:
    for lesson in course.lessons:
        if lesson.id == owner:
            return f"a lab of lesson {owner}, “{lesson.title}”"
    title = next((page.title for page in course.pages if page.id == owner), owner)
    return f"a lab of the page “{title}”"


def _seconds(lab: Lab, main: dict[str, Any]) -> float:
    """Simulated time of the main run."""
    stop = lab.fields.stopAt
    if lab.verify.seconds is not None:
        return lab.verify.seconds if stop is None else min(lab.verify.seconds, stop)
    seconds = _SECONDS if stop is None else stop
    if main["steps"] == _MOST_STEPS:
        seconds = min(seconds, round(float(main["steps"] * main["timestep"]), 9))
    return seconds


def _checked(
    context: TrialContext,
    native: NativeEngine,
    lab: Lab,
    export: Export,
    main: dict[str, Any],
    parity: Parity | None,
) -> str:
    """Why the script cannot be offered; empty if it can."""
    exact = export.exact and parity is not None and parity.first is None
    rtol = PARITY_RTOL if lab.verify.rtol is None else lab.verify.rtol
    kept = main["recorded"]
    request = {
        "path": str(context.root / "examples" / export.name),
        "text": filled(export, initial_values(lab)),
        "others": [filled(export, values) for values in _others(lab)],
        "buttons": list(export.buttons),
        "near": kept["near"],
    }
    asked = {"kept": kept, "pictures": [p["readouts"] for p in main["pictures"]], "exact": exact}
    digest = hashlib.sha256(_digest().encode())
    # The model is in it by what the trial recorded.
    for part in ({**request, "path": export.name}, {**asked, "rtol": rtol}):
        digest.update(json.dumps(part).encode() + b"\0")
    key = digest.hexdigest()
    store = context.memory.store
    found = store.get("exports", key)
    if found is not None:
        return found.decode()
    try:
        run = native.script(request)
    except NativeError as error:
        return f"the script {error}"
    reason = run["failure"] and f"the script fails: {run['failure']}"
    reason = reason or export_check.difference(main, run, exact=exact, rtol=rtol) or ""
    store.put("exports", key, reason.encode())
    return reason


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


@functools.lru_cache(maxsize=1)
def _digest() -> str:
    """A hash of how a script is run and held against the lab."""
    from coursebuild.features.lab.engines import native_worker

    files = (native_worker.__file__, export_check.__file__)
    return hashlib.sha256(b"".join(Path(file).read_bytes() for file in files)).hexdigest()
