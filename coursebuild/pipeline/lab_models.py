"""The models of labs, compiled natively and saved as browsers load them.

Entry points: `model_of_lab`, `model_of_course`, `saved_model`.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path

from msgspec import Struct

from coursebuild.core.model import Course, Lab
from coursebuild.core.model.results import CompileResult
from coursebuild.core.run.mjcf import model_files
from coursebuild.core.run.native import NativeEngine
from coursebuild.core.run.versions import engine_version
from coursebuild.pipeline.remember import Memory
from coursebuild.pipeline.remember_models import need_of


class LabModel(Struct, frozen=True):
    """A lab's model as text."""

    path: str
    """Where it stands, or would."""
    text: str
    files: tuple[str, ...]
    """Other files that it may consist of."""


def model_of_lab(
    root: Path, course: Course, models: Mapping[str, CompileResult], lab: Lab
) -> LabModel | None:
    """A lab's model; `None` for one that does not compile, as is told already."""
    if lab.xml is not None:
        path = "models/.lab.xml"
        return LabModel(path, lab.xml.text, model_files(root, path, lab.xml.text))
    compiled = models.get(lab.model or "")
    if compiled is None or compiled.facts is None:
        return None
    return model_of_course(root, course, lab.model or "")


def model_of_course(root: Path, course: Course, name: str) -> LabModel | None:
    """A model of the course; `None` where there is none of this name."""
    source = next((model.source for model in course.models if model.name == name), None)
    if source is None:
        return None
    return LabModel(source.path, source.text, model_files(root, source.path, source.text))


def saved_model(memory: Memory, native: NativeEngine, model: LabModel) -> bytes:
    """A model as an MJB file, from the store where nothing that it is made of has changed."""
    needed = [need_of(file) for file in model.files]
    states = [memory.states(need) for need in needed]
    parts = json.dumps([engine_version(), model.path, model.text, model.files, states])
    key = hashlib.sha256(parts.encode()).hexdigest()
    saved = memory.store.get("mjb", key)
    if saved is None:
        saved = native.save(model.path, model.text)
        if states == [memory.states.now(need) for need in needed]:  # none was edited meanwhile
            memory.store.put("mjb", key, saved)
    return saved
