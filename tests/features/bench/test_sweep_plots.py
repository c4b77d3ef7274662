"""Sweeps on pages: which figures are shown, and their plot."""

from __future__ import annotations

from xml.etree import ElementTree

import pytest
from msgspec.structs import replace

from coursebuild.core.model.measurements import Interval, SweepReport, SweepRow
from coursebuild.features.bench.report_plots import sweep_svg


def table(*rows: SweepRow, show: tuple[str, ...] = ()) -> SweepReport:
    return SweepReport("soft", "How <soft>", "swing", show, rows)


ROWS = (
    SweepRow("geom.solref[0]", "0.01", own=True, status="ok", penetration=1e-4, slip=0.0),
    SweepRow("geom.solref[0]", "0.1", own=False, status="ok", penetration=1e-2, slip=0.0),
    SweepRow("option.cone", "elliptic", own=False, status="diverged", reasons=("lost",)),
    SweepRow("threads", "2", own=False, status="ok", throughput=Interval(2e3, 1e3, 3e3)),
)


def test_a_sweep_without_figures_has_no_plot() -> None:
    assert sweep_svg(table(), name="p") == ""


@pytest.mark.parametrize("narrow", [False, True])
def test_every_value_is_a_dot_in_the_plot(narrow: bool) -> None:
    report = table(*ROWS, show=("penetration", "throughput"))
    root = ElementTree.fromstring(sweep_svg(report, name="p", narrow=narrow))
    titles = [element.text for path in root.iter("path") for element in path.iter("title")]
    assert titles == [
        "geom.solref[0] 0.01: 0.0001",
        "geom.solref[0] 0.1: 0.01",
        "threads 2: 2000 ± 50 %",
    ]
    texts = [element.text for element in root.iter("text")]
    assert {"geom.solref[0]", "option.cone", "diverged", "as the model is", "depth (m)"} <= {*texts}
    assert len(list(root.iter("circle"))) == 2, "around the own value, and in the key"
    assert "option.cone elliptic: depth (m) diverged" in root.findtext("desc", "")


def test_in_chaos_no_size_of_a_change_is_drawn() -> None:
    row = replace(ROWS[0], parted=2.0)
    assert "1: just visible" in sweep_svg(
        table(replace(row, change=3.0), show=("change",)), name="s"
    )
    assert "1: just visible" not in sweep_svg(table(row, show=("parted",)), name="s")
