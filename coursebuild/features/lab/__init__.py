"""Labs: simulations that a learner plays with, tried when the course is verified.

A `lab` fence holds JSON (`schema`). `parse` makes a `Lab` of it (`model`), `relations` compares
it with the course and its models, `page` shows it. `trial` runs it in the engine that browsers use
and natively; `picture` draws what was recorded, and `export` writes the lab as a Python script.
Labs of formulas and equations, which need no engine, are read and tried in `equations`.
"""

from __future__ import annotations

from coursebuild.core.features import (
    Feature,
    FenceKind,
    ModelPart,
    PagePart,
    TrialContext,
    TrialRun,
    Trials,
)
from coursebuild.features.lab.equations.declared import OdeLab, PlotLab
from coursebuild.features.lab.inputs import lab_trials, trial_inputs
from coursebuild.features.lab.model import Lab
from coursebuild.features.lab.page import (
    draw_lab,
    draw_model,
    index_lab,
    lab_markdown,
    lab_picture,
    model_picture,
    model_view,
)
from coursebuild.features.lab.parse import parse_fence
from coursebuild.features.lab.relations import check_labs, check_model_names
from coursebuild.features.lab.reply import publish_labs
from coursebuild.features.lab.schema import SimLab, refine_schema


def start(context: TrialContext) -> TrialRun:
    """Start the trials of labs; their engines are imported only here."""
    from coursebuild.features.lab.trial import LabTrials

    return LabTrials(context)


_LIVE = PagePart(
    mark="data-config=",
    texts=(
        *("lab.live.", "overlay.", "lab.plot", "lab.value", "lab.time", "lab.overlays"),
        *("lab.untitled", "lab.scale"),
    ),
)
"""The script of live labs is loaded by the element itself."""
FEATURE = Feature(
    name="lab",
    fences=(
        FenceKind(
            name="lab",
            block=Lab,
            parse=parse_fence,
            label="lab",
            draw=draw_lab,
            markdown=lab_markdown,
            index=index_lab,
            picture=lab_picture,
            docked=lambda lab: lab.fields.dock,
            tasks=lambda lab: 1,
        ),
    ),
    model_part=ModelPart(values=model_view, draw=draw_model, opens=True, picture=model_picture),
    check=check_labs,
    check_models=check_model_names,
    parts=(_LIVE,),
    trials=Trials(find=lab_trials, start=start, inputs=trial_inputs, publish=publish_labs),
    schemas={
        "lab": (SimLab, "A lab fence of the kind simlab"),
        "lab-plot": (PlotLab, "A lab fence of the kind plot"),
        "lab-ode": (OdeLab, "A lab fence of the kind ode"),
    },
    refine_schema=refine_schema,
)
