"""Reports that nobody measured."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from mjbench.machine import Machine
from mjbench.reports import Interval
from mjbench.reports.model_report import SceneReport
from mjbench.reports.scene_report import (
    FittedOrder,
    MeasuredSetting,
    OrderRow,
    RowVerdict,
    ScenarioReport,
    StableRow,
    WorkPrecisionRow,
)

MACHINE = Machine("3.14.0", "3.11.7", "2.3.0", "Linux x86_64", "A Processor @ 2 GHz")
VERDICT = RowVerdict(None, "The scene’s own setting is on the front.")
FIRST = FittedOrder(1.0, 0.01, 0.02)
_INTEGRATORS = (("Euler", 1, 1.0), ("implicit", 1, 1.2), ("RK4", 4, 3.9))


def setting(integrator: str = "Euler", timestep: float = 0.002, **fields: Any) -> MeasuredSetting:
    solving = {"solver": "", "iterations": 0, "cone": "", **fields}
    return MeasuredSetting(integrator=integrator, timestep=timestep, **solving)


def row(integrator: str = "Euler", timestep: float = 0.002, **overrides: Any) -> WorkPrecisionRow:
    """Return a row without problems; any of its fields, and of its setting's, can be given."""
    solver_fields = {
        name: overrides.pop(name) for name in ("solver", "iterations", "cone") if name in overrides
    }
    fields: dict[str, Any] = {
        "status": "ok",
        "reasons": (),
        "position": (1e-3, 5e-4),
        "attitude": None,
        "velocity": (2e-3, 1e-3),
        "figure": None,
        "energy_drift": None,
        "momentum_drift": None,
        "penetration": 0.0,
        "slip": None,
        "model_error": None,
        "refsafe": False,
        "steps": round(1 / timestep),
        "cost": 0.002 / timestep,
        "seconds": 2e-5 / timestep,
        "own": False,
        "front": False,
        "dominated_by": None,
    }
    fields["setting"] = setting(integrator, timestep, **solver_fields)
    fields |= overrides
    for name in ("cost", "seconds"):
        fields[name] = fields[name] if fields[name] is None else interval(fields[name])
    return WorkPrecisionRow(**fields)


def interval(value: float) -> Interval:
    """Return a figure with an uncertainty of one per cent."""
    return Interval(value, 0.99 * value, 1.01 * value)


def diverged_row(
    integrator: str = "Euler", timestep: float = 0.1, **overrides: Any
) -> WorkPrecisionRow:
    missing = dict.fromkeys(("position", "velocity", "cost", "seconds"))
    fields = {"status": "diverged", "reasons": ("the state is not finite",), **missing, **overrides}
    return row(integrator, timestep, **fields)


def scenario(rows: Sequence[WorkPrecisionRow], **overrides: Any) -> ScenarioReport:
    fields: dict[str, Any] = {
        "name": "swing",
        "title": "A pendulum swings",
        "duration": 1.0,
        "horizon": 1.0,
        "hold": 0.0,
        "reference": "ode",
        "source": "Bulirsch–Stoer over mj_forward",
        "floor": 1e-12,
        "second": "half the tolerance",
        "agreement": 3e-13,
        "lyapunov": None,
        "figure": "",
        "velocity_floor": 1e-11,
        "orders": (),
        "stable": (),
        "verdict": VERDICT,
    }
    return ScenarioReport(**{**fields, "rows": tuple(rows), **overrides})


def swing() -> ScenarioReport:
    """Return three integrators over a ladder of timesteps; Euler diverges at the longest."""
    rows = []
    for integrator, order, work in _INTEGRATORS:
        for timestep in (0.05, 0.02, 0.01, 0.005, 0.002, 0.001):
            if integrator == "Euler" and timestep == 0.05:
                rows.append(diverged_row(integrator, timestep))
                continue
            error = max(0.4 * (20 * timestep) ** order * 0.3, 1e-11)
            rows.append(
                row(
                    integrator,
                    timestep,
                    position=(error, error / 2),
                    velocity=(2 * error, error),
                    cost=work * 0.002 / timestep,
                    own=integrator == "Euler" and timestep == 0.002,
                    front=integrator == "RK4",
                    dominated_by=None if integrator == "RK4" else 13,
                )
            )
    text = "RK4 at 20 ms costs 0.39 times as much and is 32 times as accurate."
    return scenario(
        rows,
        orders=(
            OrderRow("Euler", FIRST, None, FittedOrder(0.99, 0.01, 0.02)),
            OrderRow("RK4", FittedOrder(4.0, 0.01, 0.02), None, None),
        ),
        stable=(
            StableRow("Euler", 0.04, (1e-3, 0.1), None, 10.0, 2.5, (0.04, 0.0402)),
            StableRow("implicit", "all", (1e-3, 0.1), None, 10.0, 2.5),
            StableRow("RK4", 0.09, (1e-3, 0.1), (0.095, 0.097), 10.0, 2.5, (0.08, 0.09)),
        ),
        verdict=RowVerdict(13, text),
    )


def scene(*scenarios: ScenarioReport, **overrides: Any) -> SceneReport:
    fields = {"model": "arm", "digest": "0" * 64, "quick": False, "machine": MACHINE, **overrides}
    return SceneReport(scenarios=scenarios or (swing(),), **fields)


def awkward() -> ScenarioReport:
    """A report that is hard to show: other solvers, refsafe, chaos, odd times."""
    newton = {"solver": "Newton", "iterations": 100, "cone": "pyramidal", "position": None}
    rows = [
        row(
            own=True,
            energy_drift=-0.0604,
            attitude=(1e-11, 1e-11),
            cost=1,
            seconds=1 / 1234.5,
            dominated_by=2,
            penetration=1e-3,
            seen=3.21,
            **newton,
        ),
        row(
            "RK4",
            status="slow-growth",
            reasons=("velocities reached 12 times their bound",),
            refsafe=True,
            **newton,
        ),
        row(
            "implicitfast",
            1 / 3000,
            front=True,
            attitude=(2.5e-4, 1e-5),
            energy_drift=1e-9,
            seen=0.00123,
            **{**newton, "solver": "CG", "iterations": 7, "cone": "elliptic"},
        ),
        diverged_row(
            "RK4",
            0.1,
            status="diverged",
            reasons=("the state is not finite",),
            **{**newton, "cone": ""},
        ),
    ]
    text = "implicitfast at 333.333 µs is better in every respect."
    return scenario(
        rows,
        title="",
        duration=10.0,
        horizon=2.5,
        lyapunov=3.21,
        horizons=(2.5, 3.75),
        horizon_error={"rad": 0.05, "m": 0.002},
        hold=0.02,
        figure="site:tip (m)",
        reference="self",
        second="",
        agreement=None,
        stable=(StableRow("Euler", "none", (1e-4, 0.1), (0.01, 0.02), 10.0, 100_000),),
        verdict=RowVerdict(2, text),
        notes=("a note that does not fit into one line of a terminal, as there are some, too",),
    )
