"""Recorded reports in a text: what was measured of a model in one of its scenarios.

A `bench` fence names a model (`parse`). `checks` compares it with the course, `page` shows what the
page of the model shows.
"""

from __future__ import annotations

from coursebuild.core.features import Feature, FenceKind
from coursebuild.features.bench.checks import check_benches, check_keyframes
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
    fences=(KIND,),
    check=check_benches,
    check_models=check_keyframes,
)
