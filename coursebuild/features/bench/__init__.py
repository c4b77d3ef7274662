"""Measurements of models, and their recorded reports on models' pages and in `bench` fences."""

from __future__ import annotations

from coursebuild.api import Command, Feature, FenceKind, ModelPart, on_demand
from coursebuild.features.bench.model import Bench, check_benches, check_keyframes, parse_bench

KIND = FenceKind(
    name="bench",
    block=Bench,
    parse=parse_bench,
    values=on_demand("coursebuild.features.bench.page:bench_view"),
    draw=on_demand("coursebuild.features.bench.page:draw_bench"),
    markdown=on_demand("coursebuild.features.bench.page:bench_markdown"),
    index=on_demand("coursebuild.features.bench.page:index_bench"),
)
FEATURE = Feature(
    name="bench",
    needs=("lab",),
    fences=(KIND,),
    model_part=ModelPart(
        facts=on_demand("coursebuild.features.bench.page:measurement_facts"),
        values=on_demand("coursebuild.features.bench.page:measurements_view"),
        draw=on_demand("coursebuild.features.bench.page:draw_measurements"),
    ),
    check=check_benches,
    check_models=check_keyframes,
    commands=(
        Command(
            name="bench",
            summary="measure speed against error for the course's models",
            module="coursebuild.features.bench.commands.bench",
        ),
        Command(
            name="diet",
            summary="find what models contain but their scenarios do not need",
            module="coursebuild.features.bench.commands.diet",
        ),
    ),
)
