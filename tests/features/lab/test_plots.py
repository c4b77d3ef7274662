"""Recorded plots: ticks, ranges of every size, gaps, names that need room, markup that holds."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from msgspec.structs import replace

from coursebuild.core.drawing.scales import tick_texts, ticks
from coursebuild.features.lab.picture.static import plot_svg, recorded_svg
from coursebuild.features.lab.schema import Plot, RefLine, TraceFields
from support.fixture_cases import check_lines

MOVE = re.compile(r"([ML])(-?[\d.]+) (-?[\d.]+)|(h0)")


def plot(*names: str, dash: Any = False, **fields: Any) -> Plot:
    traces = tuple(TraceFields(name, "1", dash) for name in names or ("a",))
    return Plot(traces, **{"ylabel": "y (m)", "xlabel": "time (s)", **fields})


def draw_plot(
    traces: Sequence[Sequence[float | None]],
    times: Sequence[float] | None = None,
    spec: Plot | None = None,
    **options: Any,
) -> ElementTree.Element:
    """Draw a plot; it must be well-formed XML, and all that it shows inside its frame."""
    chosen_plot = spec or plot(*(f"t{i}" for i in range(len(traces))))
    svg = plot_svg(
        chosen_plot, times or [float(i) for i in range(len(traces[0]))], traces, **options
    )
    root = ElementTree.fromstring(svg)
    _, _, width, height = (float(x) for x in root.attrib["viewBox"].split())
    for x, y in points(root):
        assert 0 <= x <= width and 0 <= y <= height
    for text in root.iter("text"):
        if "x" in text.attrib:
            assert 0 <= float(text.attrib["x"]) <= width
            assert 0 <= float(text.attrib["y"]) <= height
    return root


def lines(root: ElementTree.Element) -> list[str]:
    return [p.attrib["d"] for p in root.iter("path") if "lab-trace" in p.attrib["class"]]


def points(root: ElementTree.Element) -> list[tuple[float, float]]:
    return [(float(m[2]), float(m[3])) for d in lines(root) for m in MOVE.finditer(d) if m[1]]


def texts(root: ElementTree.Element, cls: str | None = None) -> list[str]:
    elements = (t for t in root.iter("text") if cls is None or cls in t.attrib.get("class", ""))
    return [text.text or "" for text in elements]


class TestTicks:
    def test_texts(self, rewriting: bool) -> None:
        def convert(ends: str) -> list[str]:
            low, high = map(float, ends.split())
            return [" ".join(tick_texts(ticks(low, high)))]

        check_lines(Path(__file__).with_name("ticks.md"), convert, rewriting=rewriting)

    @settings(max_examples=200)
    @given(st.floats(-1e12, 1e12), st.floats(1e-6, 1e12), st.integers(2, 8))
    def test_they_lie_in_the_range_and_tell_themselves_apart(
        self, low: float, span: float, count: int
    ) -> None:
        high = low + span
        values = ticks(low, high, count)
        assert 1 <= len(values) <= 2 * count + 2
        slack = 1e-6 * span + 1e-9 * abs(low)
        assert all(low - slack <= value <= high + slack for value in values)
        assert values == sorted(values)
        if len(set(values)) == len(values) and abs(low) < 1e9 * span:
            assert len(set(tick_texts(values))) == len(values)

    def test_no_range(self) -> None:
        assert ticks(5, 5) == [5]
        assert ticks(5, 4) == [5]
        assert ticks(0, math.inf) == [0]
        assert tick_texts([0.0]) == ["0"]
        assert tick_texts([2.5]) == ["2.5"]


@settings(max_examples=80, deadline=None)
@example([9007199254740994.0, 0.0], None, 1.0, None, "a large number next to a small one", False)
@example([1.7e308, -1.7e308, 0.0], None, None, None, "the largest", True)
@example([1.0, 1.0 + 2e-16, 1.0], None, None, None, "all but the same", False)
@example([None, math.nan, -math.inf], None, None, None, "nothing", True)
@given(
    st.lists(st.one_of(st.none(), st.floats(width=64)), min_size=1, max_size=12),
    st.one_of(st.none(), st.floats(-1e6, 0)),
    st.one_of(st.none(), st.floats(0.001, 1e6)),
    st.one_of(st.none(), st.floats(0.1, 20)),
    st.text(max_size=20),
    st.booleans(),
)
def test_any_samples_become_a_plot(
    values: list[float | None],
    ymin: float | None,
    ymax: float | None,
    window: float | None,
    label: str,
    narrow: bool,
) -> None:
    spec = plot(
        label, ymin=ymin, ymax=ymax, window=window, ylabel=label, refLines=(RefLine(0.5, label),)
    )
    draw_plot([values], spec=spec, narrow=narrow)


def test_what_is_no_number_interrupts_the_line() -> None:
    root = draw_plot([[1.0, 2.0, math.nan, 3.0, None, 4.0, 5.0, 6.0]])
    (line,) = lines(root)
    assert [m[1] or m[4] for m in MOVE.finditer(line)] == ["M", "L", "M", "h0", "M", "L", "L"]
    assert 'stroke-linecap="round"' in ElementTree.tostring(root).decode()


def test_one_sample_is_a_point() -> None:
    root = draw_plot([[3.0]], [7.5])
    assert re.fullmatch(r"M[\d.]+ [\d.]+h0", lines(root)[0])
    assert texts(root, "lab-name") == ["t0"]
    assert plot_svg(plot("a"), [], [[]]) == "", "nothing is drawn of nothing"


def test_a_window_shows_the_end() -> None:
    times = [i / 10 for i in range(101)]
    root = draw_plot([times], times, plot("a", window=2.0))
    assert lines(root)[0].count("L") == 20
    assert texts(root)[-4:-2] != ["0.0"] and "8.0" in texts(root) and "7.5" not in texts(root)


def test_a_line_is_cut_at_the_frame() -> None:
    spec = plot("a", ymin=0.0, ymax=1.0)
    root = draw_plot([[0.5, 5.0, 5.0, 0.5, -4.0, 0.5]], spec=spec)
    path = points(root)
    top, bottom = min(y for _, y in path), max(y for _, y in path)
    assert (top, bottom) == (24.0, 172.0)
    assert [m[1] for m in MOVE.finditer(lines(root)[0])] == ["M", "L", "M", "L", "L", "M", "L"]
    # From 0.5 to 5 in a step: the frame ends a ninth of the way on.
    step = (path[-1][0] - path[0][0]) / 5
    assert path[1][0] - path[0][0] == pytest.approx(step / 9, abs=0.11)


def test_a_line_outside_is_not_drawn_and_its_name_is() -> None:
    root = draw_plot([[5.0, 6.0, 7.0]], spec=plot("far", ymin=0.0, ymax=1.0))
    assert lines(root) == [""]
    assert texts(root, "lab-name") == ["far"]


def test_limits_are_kept_to_the_letter() -> None:
    root = draw_plot([[1.0, 2.0]], spec=plot("a", ymin=-7.0, ymax=7.0))
    grid = [p for p in root.iter("path") if p.attrib["class"] == "lab-grid"]
    assert texts(root)[: len(grid)] == ["−5", "0", "5"]


def test_names_of_lines_do_not_overlap_and_long_ones_get_room() -> None:
    for value in (0.0, 1.0, 0.5):
        root = draw_plot([[0.0, value]] + [[value, value]] * 7 + [[1.0, 1.0 - value]])
        names = (t for t in root.iter("text") if "lab-name" in t.get("class", ""))
        places = sorted(float(name.attrib["y"]) for name in names)
        assert len(places) == 9
        assert min(b - a for a, b in pairwise(places)) >= 12.9
    short, long = (draw_plot([[0.0, 1.0]], spec=plot(name)) for name in ("a", "angular momentum"))
    assert points(short)[-1][0] - points(long)[-1][0] > 80


def test_wide_ticks_get_room_and_times_do_not_touch() -> None:
    left = [points(draw_plot([[0.0, top]]))[0][0] for top in (1.0, 123456.0, 1e-13)]
    assert left[0] < left[1]
    assert all(x >= 8 + 6.2 * 3 for x in left)
    times = [1e5 + i / 1000 for i in range(100)]
    root = draw_plot([times], times, narrow=True)
    labels = [t for t in root.iter("text") if "y" in t.attrib]
    y = max(float(t.attrib["y"]) for t in labels) - 17
    time_labels = [t for t in labels if float(t.attrib["y"]) == pytest.approx(y, abs=2)]
    places = sorted((float(t.attrib["x"]), len(t.text or "")) for t in time_labels)
    assert len(places) > 1
    for (x, n), (next_x, _) in pairwise(places):
        assert next_x - x > 6.2 * n


def test_lines_differ_by_more_than_colour_unless_the_author_says_how() -> None:
    def dashes(spec: Plot | None = None, count: int = 1) -> list[str | None]:
        paths = draw_plot([[0.0, 1.0]] * count, spec=spec).iter("path")
        return [p.get("stroke-dasharray") for p in paths if "lab-trace" in p.attrib["class"]]

    assert len(set(dashes(count=5))) == 5
    assert dashes(plot("a", dash=True)) == ["6 3"]
    assert dashes(plot("a", dash=(4.0, 1.5))) == ["4 1.5"]


def test_reference_lines_inside_the_range_only() -> None:
    lines = (RefLine(0.5, "half"), RefLine(3.0, "three"), RefLine(1.0, "top"))
    labels = texts(draw_plot([[0.0, 1.0]], spec=plot("a", ymin=0.0, ymax=1.0, refLines=lines)))
    assert "half" in labels and "top" in labels and "three" not in labels


def test_texts_are_escaped() -> None:
    nasty = '<b> & "x" \u2028 </svg><script> \x00\x07\ufffe'
    root = draw_plot([[0.0, 1.0]], spec=plot(nasty, ylabel=nasty, xlabel=nasty))
    clean = '<b> & "x" \u2028 </svg><script> '
    assert texts(root, "lab-name") == [clean]
    assert clean in root.attrib["aria-label"]
    assert not list(root.iter("script"))


def test_a_plot_is_named_by_words_of_its_lab_alone() -> None:
    """They are in the language of the page."""
    for fields, name in (
        ({"ylabel": "Winkel (rad)", "xlabel": "Zeit (s)"}, "Winkel (rad), Zeit (s), oben, unten"),
        ({"ylabel": "Winkel (rad)", "xlabel": ""}, "Winkel (rad), oben, unten"),
        ({"ylabel": "", "xlabel": ""}, "oben, unten"),
    ):
        root = draw_plot([[0.0, 1.0], [1.0, 2.0]], spec=plot("oben", "unten", **fields))
        assert root.attrib["aria-label"] == name


def test_plot_of_one_quantity_against_another_has_its_last_column_across() -> None:
    spec = plot("a", x="data.qpos[0]", xlabel="")
    times, columns = [0.0, 1.0, 2.0, 3.0], [[1.0, 0.0, 1.0, 2.0], [0.0, 1.0, 0.0, None]]
    root = ElementTree.fromstring(recorded_svg(spec, times, columns, ".", narrow=False))
    (first, second, third), _ = zip(*points(root), strict=True)
    assert first == third < second
    assert "data.qpos[0]" in texts(root)
    recent = ElementTree.fromstring(
        recorded_svg(replace(spec, window=2.0), times, columns, ".", narrow=False)
    )
    assert len(points(recent)) == 2
