"""Reports in words: the verdict first, no wider than the terminal, nothing that changes it."""

from __future__ import annotations

from typing import Any

from msgspec.structs import replace

from mjbench.derive import derive_case, derive_charts, derive_scenario
from mjbench.reports import Interval
from mjbench.reports.diet_report import (
    INTERFACE_LABEL,
    PROVED_LABEL,
    DietReport,
    DietScenario,
    Finding,
    ModelPlace,
    Saving,
    TextEdit,
)
from mjbench.reports.model_report import BatchCost, EngineReport, EngineRow, EngineScenario
from mjbench.reports.page import scene_page
from mjbench.reports.scene_report import FigureLine, SweepReport, SweepRow, WorkPrecisionRow
from mjbench.reports.terminal import Style
from mjbench.text import case_text, diet_text, engines_text, scene_text
from samples.cases import case
from samples.reports import MACHINE, awkward, row, scenario, scene, setting, swing


def test_the_verdict_comes_first_then_the_table_then_the_plot() -> None:
    text = scene_text(scene(derive_charts(derive_scenario(swing(), lambda _: ()))), Style(80))
    parts = (
        "Euler at 2 ms: 100 times real time",
        "RK4 at 10 ms is better",
        "\n    >",
        "│",
        "  bounded",
    )
    places = [text.index(part) for part in parts]
    assert places == sorted(places)
    assert "no room for: " in text or "position" in text
    assert max(map(len, text.splitlines())) < 140


def test_a_report_that_is_hard_to_show_and_one_without_anything() -> None:
    figures = (FigureLine("last", "m", "RK4", None, 1.5, "as declared"),)
    report = derive_charts(derive_scenario(replace(awkward(), figures=figures), lambda _: ()))
    text = scene_text(scene(report, quick=True), Style(100))
    assert "quick: fewer settings" in text and "velocities reached 12 times their bound" in text
    assert "last under RK4: none, in theory 1.5 (as declared)\n" in text
    empty = replace(scene(), scenarios=())
    assert "nothing in it can move, so nothing was measured" in scene_text(empty)


def test_names_cannot_change_the_terminal() -> None:
    name = "a\x1b[31m\u202e名前"
    odd = derive_scenario(scenario([row(name, own=True)], name=name, notes=(name,)), lambda _: ())
    text = scene_text(scene(odd, model=name), Style(80, colour=True))
    assert "\x1b[31m" not in text and "\u202e" not in text and "名前" in text
    assert "\x1b[1m" in text, "what stands out still does"


def test_a_hard_case_has_its_orders_limits_figures_and_runs() -> None:
    text = case_text(derive_case(case()), Style(120))
    for part in ("against the oscillator", "1.00 ± 0.01", "200 ms", "6.283"):
        assert part in text, part
    (near, _) = case().errors
    near = replace(near, position=(5e-4, 5e-4))
    text = case_text(derive_case(case(errors=(near,))))
    assert "to err by 0.001, a simulated second takes Euler 100 µs\n" in text
    assert "E Euler\n" in text, "no run is the model's own, or lost"


def test_a_page_needs_nothing_else_and_escapes_names() -> None:
    report = derive_charts(derive_scenario(replace(swing(), title="<b>"), lambda _: ()))
    machine = replace(MACHINE, governor="powersave")
    html = scene_page(scene(report, model="<arm>", machine=machine))
    assert "clock governor powersave</p>" in html
    assert html.count("<svg") == 1 and "<li>Euler at 2 ms: 100 times real time</li>" in html
    assert "<b>" not in html and "&lt;arm&gt;" in html and "http" not in html
    assert html.count("<circle") > 15 and "the state is not finite" in html


def finding(kind: str, label: str, time: float | None, **fields: object) -> Finding:
    place = ModelPlace(kind, "mujoco", "arm.xml", 9, 5)
    edit = TextEdit("arm.xml", 9, 1, "<gyro/>", "")
    values: dict[str, object] = {
        "kind": kind, "message": f"nothing reads the {kind}", "places": (place,), "label": label,
        "difference": 0.0, "scenarios": ("go",), "proof": "",
        "saving": Saving(time, 0.01, True, 120, 40), "edits": (edit,),
        "fixable": label == PROVED_LABEL, "unfixed": "", "kept": "", "doubt": "", **fields,
    }  # fmt: skip
    return Finding(**values)


def diet(*findings: Finding) -> DietReport:
    go = DietScenario("go", "ok", ())
    return DietReport("arm", "0", False, MACHINE, (go,), findings, (), ())


def test_the_diet_names_what_shows_a_saving_and_folds_what_saves_little() -> None:
    report = diet(
        finding("energy-flag", PROVED_LABEL, 1.2),
        finding("island", "the same in what was run", 1.3),
        finding("cone", "the same in what was run", 1.02),
        finding("sensor-unread", INTERFACE_LABEL, 1.4),
    )
    text = diet_text(report, "mjbench diet arm.xml", "arm.toml", Style(200))
    assert "shown by `mjbench diet arm.xml --only island`" in text
    assert "saves less than 5 %, or no time that was measured: nothing reads the cone" in text
    assert "interface: nothing reads the sensor-unread, of the code that was looked at" in text
    assert "1 finding not explained, 1 of them for `mjbench diet arm.xml --fix`" in text
    assert '[[keep]] finding = "energy-flag energy-flag", reason = …' in text
    assert not report.ok and diet(*report.findings[1:]).ok


def test_an_engine_has_what_a_step_costs_by_number_of_worlds() -> None:
    costs = (BatchCost(1, Interval(2e-6, 2e-6, 2e-6)), BatchCost(64, remark="no memory"))
    lost: dict[str, Any] = {"position": None, "attitude": None, "velocity": None}
    engine = EngineRow(
        **lost, engine="mjx", title="MJX", versions=(), status="ok", bits=32, costs=costs
    )
    refusal = replace(engine, status="unsupported", message="no hinges " * 20, costs=())
    rows = (engine, refusal)
    run = EngineScenario("a", "A", 1.0, 1.0, "ode", "theory", 0.0, 0.0, setting(), rows)
    text = engines_text(
        EngineReport("arm", "", quick=True, machine=MACHINE, load=0.0, scenarios=(run,))
    )
    assert "MJX, 32 bits" in text and "1: 500,000; 64: no memory\n" in text
    assert "    MJX, 32 bits: unsupported, no hinges no hinges" in text and "no room" not in text


def test_a_sweep_shows_the_figures_that_are_to_be_shown() -> None:
    rows = (SweepRow("h", "1", True, "ok", figure=0.5, slip=0.25, cost=Interval(7, 7, 7)),)
    sweep = SweepReport("s", "S", "go", ("figure", "cost"), rows)
    text = scene_text(replace(scene(), sweeps=(sweep,)))
    assert "  parameter  value  figure  cost\n" in text and " 0.5     7\n" in text


def test_costs_that_are_uncertain_say_so() -> None:
    wide: WorkPrecisionRow = replace(row(own=True, seen=0.5), cost=Interval(1.0, 0.5, 2.0))
    text = scene_text(scene(derive_scenario(scenario([wide]), lambda _: ())))
    assert "1 ± 75 %" in text


def test_an_error_that_is_luck_is_marked_with_its_reason() -> None:
    rows = [row("Euler", 4e-3, seen=0.2), row("Euler", 2e-3, own=True, seen=0.5)]
    report = derive_charts(derive_scenario(scenario(rows), lambda _: ()))
    text = scene_text(scene(report), Style(80))
    assert "\n     ~  Euler at 4 ms" in text and "errs more   ~ luck\n" in text
    assert "Euler at 4 ms: its error rises with shorter timesteps\n" in text
    assert (
        report.charts[0].marks[1].text == "another is better, and worse in nothing, or it is luck"
    )
