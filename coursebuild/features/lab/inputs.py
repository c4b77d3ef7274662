"""What the trial of a lab depends on besides its model's files; this needs neither engine.

Entry points: `lab_trials(course)`, `trial_inputs(trial)`.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

from coursebuild.core.features import Trial
from coursebuild.core.model import Course
from coursebuild.core.run.dependencies import Inputs
from coursebuild.core.run.versions import engine_version
from coursebuild.core.text.source import key_of
from coursebuild.features.lab.checks import labs_in
from coursebuild.features.lab.compile import LabModule, compile_lab
from coursebuild.features.lab.engines.files import engine_digest, lab_digest
from coursebuild.features.lab.gallery import own_labs
from coursebuild.features.lab.model import TRIED, Lab

SECONDS = 60.0
"""Processor time that a trial may take."""
_UNTRIED = ("id", "title", "model", "height", "toggles")
"""Data that no trial depends on."""


def lab_trials(course: Course) -> Iterator[Trial]:
    """Every lab of a course, in order; then those of models that have none in a text."""
    for owner, document in course.owned_documents:
        for number, lab in enumerate(labs_in((document,)), 1):
            yield Trial(f"{owner.id}-lab-{number}", owner.id, lab)
    for model, lab in own_labs(course):
        yield Trial(f"model-{model.name.replace('/', '-')}", model.name, lab)


def trial_inputs(trial: Trial) -> Inputs | None:
    """Those of a lab; `None` for one of the course's own kinds, which is not run."""
    lab = trial.block
    if not isinstance(lab, Lab) or lab.kind not in TRIED:
        return None
    return inputs_of(lab, compile_lab(lab, trial.name))


def inputs_of(lab: Lab, module: LabModule) -> Inputs:
    """What the trial of a lab depends on besides the files of its model."""
    text = key_of(
        json.dumps(tried_data(module)),
        module.literal,
        f"{lab.verify.seconds}/{lab.verify.rtol is None}",
        lab.xml.text if lab.xml is not None else f"models/{lab.fields.model}.xml",
    )
    around = (
        ("MuJoCo", engine_version()),
        ("how a lab is repeated natively", lab_digest("engines/native_worker.py")[:12]),
        ("the browser's engine and its trial", engine_digest()[:12]),
    )
    return Inputs(f"lab {module.name}", text, (), SECONDS, (), around)


def tried_data(module: LabModule) -> dict[str, Any]:
    """What of a lab's data its trial is given."""
    config: dict[str, Any] = json.loads(module.config)
    return {name: value for name, value in config.items() if name not in _UNTRIED}
