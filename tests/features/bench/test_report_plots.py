"""Plots of reports and sweeps: every one is a drawing in which everything is told apart."""

from __future__ import annotations

import re
from typing import Any
from xml.etree import ElementTree

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

from coursebuild.core.drawing.scales import text_width
from coursebuild.core.model.measurements import Interval, ScenarioReport, SweepReport, SweepRow
from coursebuild.features.bench.chart import line_look, outline
from coursebuild.features.bench.report_plots import plot_svgs, sweep_svg
from support.bench_reports import diverged_row, row, scenario, swing
from support.plain_html import WORDS

PLACE = re.compile(r"(-?\d+\.?\d*) (-?\d+\.?\d*)")


def parse_plot(report: ScenarioReport, number: int = 0, **options: Any) -> ElementTree.Element:
    """A plot: well-formed, everything inside of it, and no two texts over each other."""
    svg = plot_svgs(report, WORDS, name="p", **options)[number]
    root = ElementTree.fromstring(svg)
    _, _, width, height = (float(x) for x in root.attrib["viewBox"].split())
    boxes = []
    for text in root.iter("text"):
        assert text.text
        if "x" not in text.attrib:
            continue
        x, y = float(text.attrib["x"]), float(text.attrib["y"])
        wide = text_width(text.text, float(text.attrib.get("font-size", "12"))) * 0.85
        left = x - {"end": wide, "middle": wide / 2}.get(text.attrib.get("text-anchor", ""), 0)
        assert left >= -1 and left + wide <= width + 1, text.text
        assert 0 <= y <= height, text.text
        boxes.append((left, y - 8, left + wide, y, text.text))
    for i, a in enumerate(boxes):
        for b in boxes[i + 1 :]:
            apart = a[2] <= b[0] or b[2] <= a[0] or a[3] <= b[1] or b[3] <= a[1]
            assert apart, (a, b)
    for path in root.iter("path"):
        for x, y in PLACE.findall(path.attrib["d"].split("a")[0].split("l")[0].split("h")[0]):
            assert -1 <= float(x) <= width + 1
            assert -1 <= float(y) <= height + 1
    return root


def titles(root: ElementTree.Element) -> list[str]:
    return [title.text or "" for path in root.iter("path") for title in path.iter("title")]


def texts(root: ElementTree.Element) -> list[str]:
    return [text.text or "" for text in root.iter("text")]


@pytest.mark.parametrize("narrow", [False, True])
def test_every_row_is_a_mark_that_says_what_it_is(narrow: bool) -> None:
    report = swing()
    root = parse_plot(report, narrow=narrow)
    tooltips = titles(root)
    assert len(tooltips) == len(report.rows)
    assert (
        "RK4 at 20 ms · error 0.00307 · cost 0.39 ± 1 % · 50 steps · 200 evaluations · "
        "whatever is cheaper errs more" in tooltips
    )
    assert (
        "Euler at 2 ms · error 0.0048 · cost 1 ± 1 % · 500 steps · the scene’s own setting · "
        "RK4 at 10 ms is better, and worse in nothing" in tooltips
    )
    (lost_title,) = [title for title in tooltips if "diverged" in title]
    assert lost_title == "Euler at 50 ms · diverged; the state is not finite · not timed · 20 steps"
    (cross,) = (path for path in root.iter("path") if path.findtext("title") == lost_title)
    assert cross.attrib["fill"] == "none" and "l" in cross.attrib["d"]
    labels = texts(root)
    assert "the scene’s own: Euler at 2 ms" in labels
    assert "cost, relative to the scene’s own setting" in labels
    assert "error: position (m or rad)" in labels
    for name in ("Euler", "implicit", "RK4"):
        assert name in labels


def test_what_is_not_resolved_is_a_band() -> None:
    rows = [row("RK4", h, position=(max(h**4, 1e-10),) * 2) for h in (0.1, 0.01, 0.001)]
    for floor, expected in ((1e-11, True), (1e-16, False)):
        labels = texts(parse_plot(scenario(rows, floor=floor)))
        assert ("under 10⁻¹⁰: not resolved by the reference" in labels) is expected


def test_what_is_below_the_scale_is_said_away_from_the_runs() -> None:
    rows = [row("RK4", h, position=(max(h**4, 1e-5),) * 2) for h in (0.1, 0.03, 0.01, 0.003, 0.001)]
    root = parse_plot(scenario(rows, floor=1e-16))
    (note,) = (text for text in root.iter("text") if (text.text or "").startswith("not resolved:"))
    half = text_width(note.text or "", 11) / 2
    for path in root.iter("path"):
        if path.findtext("title"):
            x, y = map(float, PLACE.findall(path.attrib["d"])[0])
            is_apart = abs(x - float(note.attrib["x"])) > half
            assert is_apart or not -2 < float(note.attrib["y"]) - y < 18


def test_from_where_on_an_error_is_visible() -> None:
    for *errors, expected in ((30.0, 0.02, True), (5.0, 2.0, True), (1e5, 1e3, False)):
        rows = [row("RK4", 0.01 / (n + 1), seen=error) for n, error in enumerate(errors)]
        labels = texts(parse_plot(scenario(rows)))
        assert ("just visible" in labels) is expected
        assert "error: what is seen (1: just visible)" in labels


def test_the_key_says_what_there_is_and_nothing_else() -> None:
    labels = texts(parse_plot(swing()))
    assert labels[-5:] == [
        *("RK4", "whatever is cheaper errs more", "another is better, and worse in nothing"),
        *("the scene’s own: Euler at 2 ms", "run lost"),
    ]
    assert texts(parse_plot(scenario([row(front=True)])))[-1] == "whatever is cheaper errs more"


def test_eight_lines_differ_in_dash_and_mark() -> None:
    assert len({line_look(number) for number in range(8)}) == 8
    assert len({outline(number, 0, 0, 1) for number in range(8)}) == 8


def test_the_own_setting_is_ringed_also_where_it_was_lost() -> None:
    for report in (swing(), scenario([diverged_row(own=True), row("RK4", 0.01)])):
        root = parse_plot(report)
        first, *_ = root.iter("circle")
        assert first.attrib["r"] == "8.5"
        assert [text for text in texts(root) if text.startswith("the scene’s own: Euler at ")]


def test_a_cost_has_a_bar_as_wide_as_its_interval() -> None:
    wide = Interval(1.0, 0.5, 2.0)
    root = parse_plot(scenario([replace(row(), cost=wide), row("RK4", 0.01), row("RK4", 1e-4)]))
    paths = " ".join(path.attrib["d"] for path in root.iter("path"))
    bars = re.findall(r"M([\d.]+) [\d.]+H([\d.]+)M\S+ [\d.]+v6M", paths)
    widths = [float(end) - float(start) for start, end in bars]
    assert len(bars) == 3 and widths[0] > 20 * max(widths[1:])


def test_described_for_who_cannot_see_it() -> None:
    root = parse_plot(swing())
    assert root.attrib["role"] == "img"
    assert root.attrib["aria-labelledby"] == "p-title p-text"
    title, text = root.find("title"), root.find("desc")
    assert title is not None and text is not None
    assert title.attrib["id"] == "p-title" and text.attrib["id"] == "p-text"
    assert title.text == "A pendulum swings: error of position (m or rad) against cost"
    assert text.text == (
        "Euler: errors 0.048 to 0.0024 at costs of 0.1 to 2. "
        "implicit: errors 0.12 to 0.0024 at costs of 0.048 to 2.4. "
        "RK4: errors 0.12 to 1.9e-08 at costs of 0.156 to 7.8. "
        "Runs were lost under Euler. "
        "The scene’s own setting is Euler at 2 ms. "
        "No error below 1.0e-11 is given."
    )


def test_other_solvers_are_small_marks_without_a_line() -> None:
    rows = [row("Euler", h, solver="Newton", iterations=100) for h in (0.004, 0.002)]
    rows.append(row("Euler", 0.002, solver="CG", iterations=100, own=False))
    rows[1] = replace(rows[1], own=True)
    root = parse_plot(scenario(rows))
    assert "other solver, iterations or cone" in texts(root)
    lines = [p for p in root.iter("path") if p.attrib.get("stroke-width") == "1.7"]
    assert lines[0].attrib["d"].count("L") == 1
    small = [path for path in root.iter("path") if "a2.9" in path.attrib["d"]]
    assert ["CG" in (title.text or "") for path in small for title in path.iter("title")] == [True]


def test_where_nothing_was_timed_work_is_counted() -> None:
    rows = [
        replace(row("Euler", h, own=h == 0.002), cost=None, evaluations=round(1 / h))
        for h in (0.002, 0.001)
    ]
    root = parse_plot(scenario(rows))
    assert "evaluations of the forward dynamics" in texts(root)
    assert root.findtext("title", "").endswith(" against evaluations of the forward dynamics")


def test_where_nothing_errs_there_is_no_plot() -> None:
    none = {"position": (0.0, 0.0), "velocity": (0.0, 0.0), "attitude": (0.0, 0.0), "seen": 0.0}
    assert scenario([row(own=True, **none), row("RK4", **none)]).charts == ()


def test_the_error_of_a_cone_is_a_level_of_its_own() -> None:
    cone = {"solver": "Newton", "iterations": 100, "cone": "pyramidal"}
    rows = [
        row("Euler", 0.01 / (n + 1), seen=5.0 + error, step_error=error, own=n == 0, **cone)
        for n, error in enumerate((3.0, 0.2))
    ]
    labels = texts(parse_plot(scenario(rows, contact_model={"pyramidal": 5.0})))
    assert {"just visible", "the pyramidal cone's own error"} <= set(labels)
    assert "error: what is seen of steps (1: just visible)" in labels


ERRORS = st.one_of(st.just(0.0), st.floats(1e-300, 1e300))
STATUS = st.sampled_from(("ok", "ok", "ok", "diverged", "reset", "slow-growth"))


@given(
    rows=st.lists(
        st.tuples(
            st.sampled_from(("Euler", "implicit", "implicitfast", "RK4", "discrete")),
            st.sampled_from((0.1, 0.01, 0.002, 0.0001)),
            ERRORS,
            st.one_of(st.none(), st.floats(1e-12, 1e12)),
            STATUS,
        ),
        max_size=12,
    ),
    floor=st.sampled_from((0.0, 1e-15, 1e-3)),
    narrow=st.booleans(),
)
def test_any_report_is_drawn(rows: Any, floor: float, narrow: bool) -> None:
    report_rows = [
        row(name, h, position=(e, e), velocity=None, cost=cost, status=status, own=n == 0)
        for n, (name, h, e, cost, status) in enumerate(rows)
    ]
    for svg in plot_svgs(scenario(report_rows, floor=floor), WORDS, name="p", narrow=narrow):
        assert len(titles(ElementTree.fromstring(svg))) == len(report_rows)


def table(*rows: SweepRow, show: tuple[str, ...] = ()) -> SweepReport:
    return SweepReport("soft", "How <soft>", "swing", show, rows)


ROWS = (
    SweepRow("geom.solref[0]", "0.01", own=True, status="ok", penetration=1e-4, slip=0.0),
    SweepRow("geom.solref[0]", "0.1", own=False, status="ok", penetration=1e-2, slip=0.0),
    SweepRow("option.cone", "elliptic", own=False, status="diverged", reasons=("lost",)),
    SweepRow("option.cone", "pyramidal", own=False, status="ok", cost=Interval(2, 1, 3)),
)


def test_a_sweep_without_figures_has_no_plot() -> None:
    assert sweep_svg(table(), WORDS, name="p") == ""


@pytest.mark.parametrize("narrow", [False, True])
def test_every_value_is_a_dot_in_the_plot(narrow: bool) -> None:
    report = table(*ROWS, show=("penetration", "cost"))
    root = ElementTree.fromstring(sweep_svg(report, WORDS, name="p", narrow=narrow))
    names = [element.text for path in root.iter("path") for element in path.iter("title")]
    assert names == [
        "geom.solref[0] 0.01: 0.0001",
        "geom.solref[0] 0.1: 0.01",
        "option.cone pyramidal: 2 ± 50 %",
    ]
    texts = [element.text for element in root.iter("text")]
    assert {"geom.solref[0]", "option.cone", "diverged", "as the model is", "depth (m)"} <= {*texts}
    assert len(list(root.iter("circle"))) == 2, "around the own value, and in the key"
    assert "option.cone elliptic: depth (m) diverged" in root.findtext("desc", "")


def test_in_chaos_no_size_of_a_change_is_drawn() -> None:
    row = replace(ROWS[0], parted=2.0)
    assert "1: just visible" in sweep_svg(
        table(replace(row, change=3.0), show=("change",)), WORDS, name="s"
    )
    assert "1: just visible" not in sweep_svg(table(row, show=("parted",)), WORDS, name="s")
