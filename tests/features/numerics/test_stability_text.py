"""The report on the hard cases, as text."""

from __future__ import annotations

from msgspec.structs import replace

from coursebuild.features.numerics.commands.text import stability_text
from coursebuild.report import Style
from support.model_reports import case

TEXT = """\
spring  case 5: A <spring>
  No timestep that was tried brings the error down to 10⁻³.
  It swings.
  References: the oscillator; Bulirsch–Stoer.
  They differ by 1 × 10⁻¹³ in position and 4 × 10⁻¹³ in velocity.
  Theory: 2/ω.
  refsafe softens constraints, which makes another model: 500 ms.
  Euler at 500 ms: diverged; 1e9 rad/s.

  A <spring>: Largest stable timesteps over 50 s, with at most 2.5 J
  Integrator          Largest stable timestep  Steps  Tried up to it  Theory  Difference
  Euler                                200 ms    250    60 from 1 ms  200 ms    −0.050 %
  RK4                                  280 ms    250    60 from 1 ms
  implicit, discrete            all up to 1 s    250    60 from 1 ms
  none                      none from 1 ms on    250    60 from 1 ms    none
  RK4: some are stable again, from 300 ms to 310 ms

  Known quantities: A <spring>
  Integrator       Measured  Exact    Difference
  Period (s)
  Euler, RK4           6.28   6.28   −1.9 × 10⁻⁴
  Energy
  RK4         −4.10 × 10⁻¹⁰      0  −4.1 × 10⁻¹⁰
  Euler          not finite

  Fitted orders: A <spring>
  Integrator       Order of position
  Euler       1.00 ± 0.01, bend 0.02

  error of position (m or rad)     Euler
  500 ms                        diverged
  10 ms                         1.50e-03
"""


def test_text_puts_integrators_with_equal_figures_together() -> None:
    first, *others = case().boundaries
    none = replace(first, integrator="none", largest=0.0, theory=0.0, difference=None)
    assert stability_text([case(boundaries=(first, *others, none))], Style()) == TEXT
