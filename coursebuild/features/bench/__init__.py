"""What is measured on models, and the recorded reports of it on their pages and in texts.

`measured` is the part of a model's page, of `scenarios` and of what the model can be without. A
`bench` fence in a text names a model (`parse`): `checks` compares it with the course, `page` shows
a scenario as the page of the model does. `commands` measures and records.
"""

from __future__ import annotations

from coursebuild.core.features import Command, Feature, FenceKind, ModelPart
from coursebuild.features.bench.checks import check_benches, check_keyframes
from coursebuild.features.bench.measured import draw_measured, measured_facts, measured_view
from coursebuild.features.bench.model import Bench
from coursebuild.features.bench.page import bench_markdown, draw_bench, index_bench, shown_bench
from coursebuild.features.bench.parse import parse_bench

KIND = FenceKind(
    name="bench",
    block=Bench,
    parse=parse_bench,
    values=shown_bench,
    draw=draw_bench,
    markdown=bench_markdown,
    index=index_bench,
)
FEATURE = Feature(
    name="bench",
    needs=("lab",),
    fences=(KIND,),
    model_part=ModelPart(facts=measured_facts, values=measured_view, draw=draw_measured),
    check=check_benches,
    check_models=check_keyframes,
    commands=(
        Command(
            name="bench",
            summary="measure speed against error of the course's models",
            module="coursebuild.features.bench.commands.bench",
        ),
        Command(
            name="diet",
            summary="say what models hold that their scenarios do not need",
            module="coursebuild.features.bench.commands.diet",
        ),
    ),
)
