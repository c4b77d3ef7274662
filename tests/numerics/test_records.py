"""Recorded reports: the same bytes, lines to compare, and nothing read that is not one."""

from __future__ import annotations

import json

import pytest

from coursebuild.numerics.reports.records import BENCH, STABILITY, RecordError
from support.bench_reports import diverged_row, row, scenario, scene, swing
from support.model_reports import case

GOOD = BENCH.encode(scene())
HEAD = b'{"holds": "coursebuild bench"'


def test_what_is_written_is_read() -> None:
    for report in (
        scene(),
        scene(scenario([])),
        scene(scenario([diverged_row(), row("Ω\n", 1e-300)])),
    ):
        data = BENCH.encode(report)
        assert BENCH.decode(data) == report
        assert BENCH.encode(BENCH.decode(data)) == data
    data = STABILITY.encode((case(),))
    assert STABILITY.decode(data) == (case(),)


def test_a_row_is_a_line_and_keys_are_sorted() -> None:
    lines = GOOD.decode().splitlines()
    assert lines[:3] == ["{", ' "form": 2,', ' "holds": "coursebuild bench",']
    assert sum('"timestep"' in line for line in lines) == len(swing().rows)
    assert GOOD.endswith(b"}\n")

    def keys(value: object) -> None:
        if isinstance(value, dict):
            assert list(value) == sorted(value)
            list(map(keys, value.values()))
        elif isinstance(value, list):
            list(map(keys, value))

    keys(json.loads(GOOD))


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"", "is damaged: input data was truncated"),
        (b"\xff", "is damaged: no JSON: invalid character (byte 0)"),
        (b"[" * 100_000, "is damaged: "),
        (b"[]", "holds no report of `coursebuild bench`"),
        (HEAD + b', "form": 1}', "was written by another version of this tool (form 1)"),
        (HEAD + b', "form": 2}', "is damaged: object missing required field `scene`"),
        (GOOD.replace(b'"value": 0.1}', b'"value": 1e999}', 1), "is damaged: number out of range"),
        (
            GOOD.replace(b'"name": "swing"', b'"name": 7'),
            "is damaged: expected `str`, got `int` - at `$.scene.scenarios[0].name`",
        ),
        (
            GOOD.replace(b'"cpu"', b'"cup"'),
            "is damaged: object contains unknown field `cup` - at `$.scene.machine`",
        ),
        (
            GOOD.replace(b'"dominated_by": 13', b'"dominated_by": -1', 1),
            "points at a row that scenario `swing` does not have",
        ),
        (BENCH.encode(scene(swing(), swing())), "holds two scenarios of one name"),
    ],
)
def test_what_is_no_report(data: bytes, message: str) -> None:
    with pytest.raises(RecordError) as caught:
        BENCH.decode(data)
    assert str(caught.value).startswith(message)


def test_two_cases_of_one_name() -> None:
    with pytest.raises(RecordError, match="holds two cases of one name"):
        STABILITY.decode(STABILITY.encode((case(), case())))
