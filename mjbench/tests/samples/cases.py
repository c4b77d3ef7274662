"""A report on a hard case that nobody measured."""

from __future__ import annotations

from mjbench.reports import Interval
from mjbench.reports.model_report import CaseReport, ErrorLine, ReferenceLine, StepCost
from mjbench.reports.scene_report import FigureLine, OrderRow, StableRow
from samples.reports import FIRST, MACHINE


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
    search = ((1e-3, 1.0), None, 50.0, 2.5)
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
            StableRow(
                "Euler",
                0.2,
                *search,
                bracket=(0.2, 0.2),
                theory=0.2001,
                formula="2/ω",
            ),
            StableRow(
                "RK4",
                0.28,
                *search,
                bracket=(0.25, 0.29),
            ),
            StableRow("implicit", "all", *search),
            StableRow("discrete", "all", *search),
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
