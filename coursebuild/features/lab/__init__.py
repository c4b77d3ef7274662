"""Labs: simulations that a learner plays with, tried when the course is verified.

`schema` declares a fence, `parse` makes a `Lab` (`model`) of it, `relations` compares it with the
course, `page` shows it, `trial` runs it in both engines, `picture` draws and `export` rewrites it.
Labs of formulas and equations, which need no engine, are read and tried in `equations`.
"""

from __future__ import annotations

from coursebuild.api import Feature, FenceKind, ModelPart, PagePart, Trials, on_demand
from coursebuild.features.lab.model import Lab, lab_trials
from coursebuild.features.lab.relations import check_labs, check_model_names
from coursebuild.features.lab.reply import publish_labs
from coursebuild.features.lab.schema import OdeLab, PlotLab, SimLab, refine_schema

_LIVE = PagePart(
    mark="data-config=",
    texts=(
        *("lab.live.", "overlay.", "lab.plot", "lab.value", "lab.time", "lab.overlays"),
        *("lab.untitled", "lab.scale"),
    ),
)
"""The script of live labs is loaded by the element itself."""
_LISTING = PagePart(mark="data-editor=", texts=("lab.live.edit",))
FEATURE = Feature(
    name="lab",
    fences=(
        FenceKind(
            name="lab",
            block=Lab,
            parse=on_demand("coursebuild.features.lab.parse:parse_fence"),
            label="lab",
            draw=on_demand("coursebuild.features.lab.page:draw_lab"),
            markdown=on_demand("coursebuild.features.lab.page:lab_markdown"),
            index=on_demand("coursebuild.features.lab.page:index_lab"),
            picture=on_demand("coursebuild.features.lab.page:lab_picture"),
            docked=lambda lab: lab.fields.dock,
        ),
    ),
    model_part=ModelPart(
        values=on_demand("coursebuild.features.lab.page:model_view"),
        draw=on_demand("coursebuild.features.lab.page:draw_model"),
        opens=True,
        picture=on_demand("coursebuild.features.lab.page:model_picture"),
    ),
    check=check_labs,
    check_models=check_model_names,
    code_links=on_demand("coursebuild.features.lab.page:editor_links"),
    parts=(_LIVE, _LISTING),
    trials=Trials(
        find=lab_trials,
        start=on_demand("coursebuild.features.lab.trial:LabTrials"),
        inputs=on_demand("coursebuild.features.lab.compile:trial_inputs"),
        publish=publish_labs,
    ),
    schemas={
        "lab": (SimLab, "A lab fence of the kind simlab"),
        "lab-plot": (PlotLab, "A lab fence of the kind plot"),
        "lab-ode": (OdeLab, "A lab fence of the kind ode"),
    },
    refine_schema=refine_schema,
)
