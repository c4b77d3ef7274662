"""Measurements of models, and their recorded reports on models' pages and in `bench` fences."""

from __future__ import annotations

from coursebuild.api import Command, Feature, FenceKind, ModelPart
from coursebuild.features.bench.model import Bench, check_benches, check_keyframes, parse_bench
from coursebuild.features.bench.page import (
    bench_markdown,
    bench_view,
    draw_bench,
    draw_measurements,
    index_bench,
    measurement_facts,
    measurements_view,
)

KIND = FenceKind(
    name="bench",
    block=Bench,
    parse=parse_bench,
    values=bench_view,
    draw=draw_bench,
    markdown=bench_markdown,
    index=index_bench,
)
FEATURE = Feature(
    name="bench",
    needs=("lab",),
    fences=(KIND,),
    model_part=ModelPart(facts=measurement_facts, values=measurements_view, draw=draw_measurements),
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
