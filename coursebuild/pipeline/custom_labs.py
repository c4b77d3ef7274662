"""Labs of the kinds that a course brings: what their own code needs, published as it is.

Entry point: `custom_lab`. The code is `content/labs/KIND.js`; docs/labs.md is its manual. What such
a lab does only its code knows, so it is not tried; that its model exists and compiles is checked.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

from coursebuild.core.files.read import read_bytes
from coursebuild.core.model import Course, Lab
from coursebuild.core.model.results import CompileResult, LabResult
from coursebuild.core.run.native import NativeEngine
from coursebuild.core.text.diagnostics import Diagnostic, diagnose, did_you_mean
from coursebuild.pipeline.lab_models import model_of_course, saved_model
from coursebuild.pipeline.remember import Memory


def custom_lab(
    root: Path,
    memory: Memory,
    native: NativeEngine,
    course: Course,
    models: Mapping[str, CompileResult],
    owner: str,
    name: str,
    lab: Lab,
) -> tuple[LabResult | None, list[Diagnostic]]:
    """A lab with its code, its data and, where its JSON has a `model`, that as an MJB file."""
    code = f"content/labs/{lab.kind}.js"
    if code not in course.files:
        return None, []  # which is told at the kind
    data = json.loads(lab.config)
    model = data.get("model")
    mjb = b""
    if isinstance(model, str):
        source = model_of_course(root, course, model)
        if source is None:
            message = f"no model `{model}` in models/"
            help = did_you_mean(model, [m.name for m in course.models])
            return None, [diagnose("lab-model", lab.span.first_line(), message, help=help)]
        if models[model].error:
            return None, []  # which is told at the model
        mjb = saved_model(memory, native, source)
    config = {"id": name, "kind": lab.kind, "title": lab.title, "data": data}
    result = LabResult(
        span=lab.span,
        name=name,
        lesson=owner,
        title=lab.title,
        status="ok",
        module=read_bytes(root, code).decode("utf-8", "replace"),
        config=json.dumps(config, ensure_ascii=False, separators=(",", ":")),
        mjb=mjb,
    )
    return result, []
