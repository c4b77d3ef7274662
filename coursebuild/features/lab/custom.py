"""Labs of a course's own kinds: what their code needs is published as it is.

Entry point: `custom_lab`. The code is `content/labs/KIND.js`; docs/explanation/how-labs-run.md
is its manual. Only its code knows what such a lab does, so there is no trial; but its model must
exist and compile.
"""

from __future__ import annotations

import json

from coursebuild.core.features import Trial, TrialContext
from coursebuild.core.files.read import read_bytes
from coursebuild.core.model.results import TrialLine, TrialResult
from coursebuild.core.text.diagnostics import Diagnostic, diagnose, did_you_mean
from coursebuild.features.lab.engines.native import NativeEngine
from coursebuild.features.lab.files import LabOutput
from coursebuild.features.lab.model import Lab
from coursebuild.features.lab.models import model_of_course, saved_model


def custom_lab(
    context: TrialContext, native: NativeEngine, trial: Trial, lab: Lab
) -> tuple[TrialResult | None, list[Diagnostic]]:
    """Publish a lab with its code, its data and, if its JSON has a `model`, that as an MJB file."""
    code = f"content/labs/{lab.kind}.js"
    if code not in context.course.files:
        return None, []  # reported at the kind
    data = json.loads(lab.config)
    name = data.get("model")
    mjb = b""
    if isinstance(name, str):
        model = model_of_course(context, name)
        if model is None:
            message = f"no model `{name}` in models/"
            help = did_you_mean(name, [m.name for m in context.course.models])
            return None, [diagnose("lab-model", lab.span.first_line(), message, help=help)]
        if context.models[name].error:
            return None, []  # reported at the model
        mjb = saved_model(context, native, model)
    config = {"id": trial.name, "kind": lab.kind, "title": lab.fields.title, "data": data}
    output = LabOutput(
        module=read_bytes(context.root, code).decode("utf-8", "replace"),
        config=json.dumps(config, ensure_ascii=False, separators=(",", ":")),
        mjb=mjb,
    )
    line = TrialLine(trial.name, lab.fields.title, trial.owner, "ok")
    return TrialResult(lab.span, line, output), []
