"""Reports that nobody measured, on the model `box` and two hard cases."""

from __future__ import annotations

from msgspec.structs import replace

from coursebuild.core.model.measurements import (
    MEASURED_LABEL,
    PROVED_LABEL,
    DietReport,
    DietScenario,
    FigureLine,
    Finding,
    Interval,
    ModelPlace,
    OrderRow,
    Saving,
    SceneCard,
    SceneReport,
)
from coursebuild.core.model.results import Reports
from coursebuild.numerics.reports.case_report import (
    BoundaryLine,
    CaseReport,
    ErrorLine,
    ReferenceLine,
    StepCost,
)
from support.bench_reports import FIRST, MACHINE, awkward, swing
from support.bench_reports import row as row
from support.bench_reports import scenario as scenario
from support.bench_reports import scene as scene

CARD = SceneCard(
    bodies=3, geoms=5, freedom=6, possible=7, touched=2, mjcf=12_345, mjb=98_765_432, browser=151.0
)


def box(card: SceneCard | None = CARD) -> SceneReport:
    return scene(swing(), replace(awkward(), name="awkward"), model="box", card=card)


def finding(kind: str = "sensor-unread", **overrides: object) -> Finding:
    fields: dict[str, object] = {
        "kind": kind,
        "message": "nothing reads <this> sensor",
        "places": (ModelPlace("tip", "mujoco/sensor/framepos", "models/box.xml", 3, 5),),
        "label": PROVED_LABEL,
        "difference": 0.0,
        "scenarios": ("swing",),
        "proof": "its value goes nowhere",
        "saving": Saving(1.07, 0.01, True, 120, 40),
        "edits": (),
        "fixable": True,
        "unfixed": "",
        "kept": "",
        "doubt": "",
        **overrides,
    }
    return Finding(**fields)


def diet(*findings: Finding) -> DietReport:
    return DietReport(
        model="box",
        digest="0" * 64,
        quick=False,
        machine=MACHINE,
        readers=(),
        scenarios=(DietScenario("swing", 500, "ok", ()),),
        findings=findings,
        tried=(),
        fixed=None,
        slim=None,
        slim_difference=None,
        stale=(),
    )


def run(**overrides: object) -> ErrorLine:
    fields: dict[str, object] = {
        "integrator": "Euler",
        "timestep": 0.01,
        "status": "ok",
        "reasons": (),
        "penetration": 0.0,
        "refsafe": False,
        **dict.fromkeys(("position", "attitude", "velocity", "energy_drift", "momentum_drift")),
        **overrides,
    }
    return ErrorLine(**fields)


def case(name: str = "spring", number: int = 5, **overrides: object) -> CaseReport:
    search = ((1e-3, 1.0), None, 50.0, 250, 60, 2.5)
    fields: dict[str, object] = {
        "name": name,
        "title": f"A <{name}>",
        "case": number,
        "machine": MACHINE,
        "note": "it swings",
        "reference": ReferenceLine(
            "closed", "the oscillator", "Bulirsch–Stoer", 1e-13, 0.0, 3.9e-13
        ),
        "boundaries": (
            BoundaryLine(
                "Euler",
                0.2,
                *search,
                bracket=(0.2, 0.2),
                theory=0.2001,
                formula="2/ω",
                difference=-5e-4,
                beyond="diverged",
                growth=1.5,
            ),
            BoundaryLine(
                "RK4",
                0.28,
                *search,
                beyond="slow-growth",
                bracket=(0.25, 0.29),
                gain=(0.1, 0.02),
                tries=((0.2, 10, 0), (0.25, 10, 2), (0.3, 10, 10)),
            ),
            BoundaryLine("implicit", None, *search),
            BoundaryLine("discrete", None, *search),
        ),
        "figures": (
            FigureLine("period", "s", "Euler", 6.283, 6.2831853, "2π√(m/k)"),
            FigureLine("period", "s", "RK4", 6.283, 6.2831853, "2π√(m/k)"),
            FigureLine("energy", "", "RK4", -4.1e-10, 0.0, ""),
            FigureLine("energy", "", "Euler", None, None, ""),
        ),
        "orders": (OrderRow("Euler", FIRST, None, None), OrderRow("discrete", None, None, None)),
        "errors": (
            run(position=(1.5e-3, 1e-3), velocity=(2e-3, 1e-3)),
            run(timestep=0.5, status="diverged", reasons=("1e9 rad/s",), refsafe=True),
        ),
        "costs": (StepCost("Euler", Interval(1e-6, 0.9e-6, 1.1e-6)),),
        **overrides,
    }
    return CaseReport(**fields)


def reports() -> Reports:
    kept_finding = finding(
        "geom-far", kept="it is the horizon", proof="", label="equal within tolerance"
    )
    fields = {"label": MEASURED_LABEL, "doubt": "examples/a.py names <it>"}
    doubted = finding("site-unused", **fields)
    return Reports(
        {"box": box()},
        {"box": diet(finding(), kept_finding, doubted)},
        (case("spring", 5), case("other", 5, note=""), case("top", 3, errors=())),
    )
