"""The script that a lab's page offers, run natively and held against the lab's trial.

Entry point: `exported(…)`. A script whose result is not that of the lab, or that fails for any
value that the page may put into it, is not offered.
"""

from __future__ import annotations

from pathlib import Path

from msgspec import Struct

from coursebuild.core.features import Trial, TrialContext
from coursebuild.core.model import Course
from coursebuild.core.run.versions import engine_version
from coursebuild.core.values import fingerprint
from coursebuild.features.lab.engines.files import lab_digest
from coursebuild.features.lab.engines.native import NativeEngine, NativeError
from coursebuild.features.lab.export.difference import difference
from coursebuild.features.lab.export.script import (
    ExportMetadata,
    export_script,
    file_name,
    filled,
    initial_values,
)
from coursebuild.features.lab.model import Lab
from coursebuild.features.lab.reply import MainRun
from coursebuild.features.lab.schema import Select, Slider
from coursebuild.features.lab.verdict import PARITY_RTOL

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
    reason = difference(main, run, rtol)
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
