"""The report on the hard cases, as text and as JSON."""

from __future__ import annotations

from coursebuild.features.numerics.commands.text import stability_text
from coursebuild.numerics.reports import Interval
from coursebuild.numerics.reports.bench import FittedOrder, OrderRow
from coursebuild.numerics.reports.cases import (
    BoundaryLine,
    CaseReport,
    ErrorLine,
    FigureLine,
    ReferenceLine,
    StepCost,
)
from coursebuild.report import Style
from support.bench_reports import FIRST, MACHINE

TRIED = (1e-3, 10.0)


def boundary(integrator: str, largest: float | None, **other: object) -> BoundaryLine:
    fields: dict[str, object] = {
        "theory": 0.2,
        "formula": "hω = 2",
        "difference": None if not largest else largest / 0.2 - 1,
        "searched": TRIED,
        "islands": None,
        "duration": 5.0,
        "steps": 25,
        "tried": 60,
        "energy": None,
        "beyond": "diverged",
        "growth": None,
    }
    return BoundaryLine(integrator, largest, **(fields | other))  # type: ignore[arg-type]


REPORT = CaseReport(
    name="spring",
    title="A spring",
    case=5,
    machine=MACHINE,
    note="begins at rest",
    reference=ReferenceLine("closed", "a textbook", "another", 1e-13, 2e-14, 1e-12),
    boundaries=(
        boundary("Euler", 0.2),
        boundary("implicit", 0.2),
        boundary("RK4", 0.25, islands=(0.4, 0.5), beyond="slow-growth", growth=1.5),
        boundary("discrete", None, theory=None, difference=None, beyond=""),
        boundary("none", 0.0, theory=0.0, formula="√(1+z²)"),
    ),
    figures=(
        FigureLine("growth", "m", "Euler", 1.25, 1.0, "a law"),
        FigureLine("growth", "m", "RK4", None, None, "a law"),
    ),
    orders=(
        OrderRow("Euler", FIRST, None, FittedOrder(0.998, 0.02, 0.1)),
        OrderRow("RK4", None, None, None),
    ),
    costs=(StepCost("Euler", Interval(1e-6, 0.9e-6, 1.1e-6)),),
    errors=(
        ErrorLine("RK4", 0.5, "diverged", ("one", "two"), None, None, None, None, None, 0.0, True),
        ErrorLine("Euler", 0.1, "ok", (), (0.1, 0.01), None, None, 1e-3, None, 0.0, False),
    ),
)
TEXT = """\
spring  case 5: A spring
  No timestep that was tried brings the error down to 10⁻³.
  Begins at rest.
  References: a textbook; another.
  They differ by 1 × 10⁻¹³ in position and 1 × 10⁻¹² in velocity.
  Theory: hω = 2; √(1+z²).
  refsafe softens constraints, which makes another model: 500 ms.
  RK4 at 500 ms: diverged; one; two.

  A spring: Largest stable timesteps over 5 s
  Integrator       Largest stable timestep  Steps  Tried up to it  Theory  Difference  Beyond it
  Euler, implicit                   200 ms     25    60 from 1 ms  200 ms         0 %   diverged
  RK4                               250 ms     25    60 from 1 ms  200 ms   +25.000 %       grew
  discrete                  all up to 10 s     25    60 from 1 ms     all
  none                   none from 1 ms on     25    60 from 1 ms    none               diverged
  RK4: some are stable again, from 400 ms to 500 ms

  Known quantities: A spring
  Integrator    Measured  Exact  Difference
  Growth (m)
  Euler             1.25   1.00        0.25
  RK4         not finite

  Fitted orders: A spring
  Integrator       Order of position       Order of velocity
  Euler       1.00 ± 0.01, bend 0.02  1.00 ± 0.02, bend 0.10

  error of position (m or rad)       RK4     Euler
  500 ms                        diverged
  100 ms                                  1.00e-01
"""


def test_text_puts_integrators_with_equal_figures_together() -> None:
    assert stability_text([REPORT], Style()) == TEXT
