"""What the trial of a lab depends on besides its model's files; computed without an engine."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

from coursebuild.core.features import Trial
from coursebuild.core.model import Course, find_blocks
from coursebuild.core.run.child import LIMITS
from coursebuild.core.run.dependencies import Inputs
from coursebuild.core.run.script_environment import package_version
from coursebuild.core.text.source import key_of
from coursebuild.features.lab.compile import LabModule, compile_lab
from coursebuild.features.lab.engines import native
from coursebuild.features.lab.model import BUILT_IN_KINDS, ODE, PLOT, Lab
from coursebuild.features.lab.page import gallery_labs

_DISPLAY_FIELDS = ("id", "title", "model", "height", "toggles")
"""Data of a lab on which no trial depends."""


def lab_trials(course: Course) -> Iterator[Trial]:
    """Yield every lab of a course, in order; then those made for models that no text shows."""
    for owner, document in course.owned_documents:
        for number, lab in enumerate(find_blocks(document, Lab), 1):
            yield Trial(f"{owner.id}-lab-{number}", owner.id, lab)
    for model, lab in gallery_labs(course):
        yield Trial(f"model-{model.name.replace('/', '-')}", model.name, lab)


def trial_inputs(trial: Trial) -> Inputs | None:
    """Return the inputs of a lab's trial; `None` if the lab is of the course's own kinds."""
    lab = trial.block
    if not isinstance(lab, Lab) or lab.kind not in BUILT_IN_KINDS:
        return None
    if lab.kind in (PLOT, ODE):
        return equation_inputs(lab, trial.name)
    return inputs_of(lab, compile_lab(lab, trial.name))


def inputs_of(lab: Lab, module: LabModule) -> Inputs:
    """Return what the trial of a lab depends on besides the files of its model."""
    text = key_of(
        json.dumps(trial_data(module)),
        module.literal,
        f"{lab.verify.seconds}/{lab.verify.rtol is None}",
        lab.xml.text if lab.xml is not None else f"models/{lab.fields.model}.xml",
    )
    conditions = (
        ("MuJoCo", native.LAB_ENGINE),
        ("how a lab is repeated natively", native.lab_digest("engines/native_worker.py")[:12]),
        ("the browser's engine and its trial", native.asset_digest(native.WASM, native.TRIAL)[:12]),
    )
    return Inputs(f"lab {module.name}", text, (), LIMITS.lab, (), conditions)


def equation_inputs(lab: Lab, name: str) -> Inputs:
    """Return what the trial of a lab without an engine depends on."""
    conditions = (
        ("SciPy", package_version("scipy")),
        ("how a lab without an engine is tried", native.lab_digest("equations")[:12]),
        ("the page's own code", native.asset_digest(native.EQUATION_TRIAL)[:12]),
    )
    return Inputs(f"lab {name}", key_of(lab.config), (), LIMITS.lab, (), conditions)


def trial_data(module: LabModule) -> dict[str, Any]:
    """Return the data of a lab without what no trial depends on."""
    return {name: value for name, value in module.config.items() if name not in _DISPLAY_FIELDS}
