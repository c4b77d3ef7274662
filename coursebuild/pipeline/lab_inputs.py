"""What the trial of a lab depends on besides its model's files; this needs neither engine.

Entry points: `labs_of(course)`, `lab_inputs(lab, name)`.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from typing import Any

from coursebuild.core.model import Course, Lab, document_blocks
from coursebuild.core.run.lab_files import engine_digest
from coursebuild.core.run.native import native_digest
from coursebuild.core.run.versions import engine_version
from coursebuild.core.scripts.dependencies import Inputs
from coursebuild.core.scripts.extract import owners
from coursebuild.labs.compile import LabModule, compile_lab

SIMULATED = "simlab"
"""The kind of labs that are tried; others are of the course's own."""
SECONDS = 60.0
"""Processor time that a trial may take."""
_UNTRIED = ("id", "title", "model", "height", "toggles")
"""Data that no trial depends on."""


def labs_of(course: Course) -> Iterator[tuple[str, str, Lab]]:
    """Every lab with the id of its lesson or page and its name, in order."""
    for owner, document in owners(course):
        labs = (block for block in document_blocks(document) if isinstance(block, Lab))
        for number, lab in enumerate(labs, 1):
            yield owner, f"{owner}-lab-{number}", lab


def lab_inputs(lab: Lab, name: str) -> Inputs:
    """What the trial of a lab depends on beside the files of its model."""
    module = compile_lab(lab, name)
    own = [
        json.dumps(tried_data(module)),
        module.literal,
        f"{lab.verify_seconds}/{lab.verify_rtol is None}",
    ]
    own.append(lab.xml.text if lab.xml is not None else f"models/{lab.model}.xml")
    text = hashlib.sha256("\0".join(own).encode()).hexdigest()
    around = (
        ("MuJoCo", engine_version()),
        ("how a lab is repeated natively", native_digest()[:12]),
        ("the browser's engine and its trial", engine_digest()[:12]),
    )
    return Inputs(f"lab {name}", text, (), SECONDS, (), around)


def tried_data(module: LabModule) -> dict[str, Any]:
    """What of a lab's data its trial is given."""
    config: dict[str, Any] = json.loads(module.config)
    return {name: value for name, value in config.items() if name not in _UNTRIED}
