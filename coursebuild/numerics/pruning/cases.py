"""The scenarios that a smaller model is judged by, at the model's own timestep.

Entry points: `cases(model, declared, quick=…)`, `Case`.
"""

from __future__ import annotations

from typing import Any

from msgspec import Struct

from coursebuild.model.scenarios import Declarations
from coursebuild.numerics.problem import Scenario, Setup, whole_number
from coursebuild.numerics.scene import scenes

QUICK = 0.5
"""Seconds at most of a scenario where it should be quick."""


class Case(Struct, frozen=True):
    """A scenario of a model."""

    name: str
    scenario: Scenario
    steps: int
    hold: int = 0
    """Steps for which a command holds; 0 where there is one command at most."""
    declared: bool = False

    @property
    def setup(self) -> Setup:
        """What a run must know of it."""
        return Setup(scenario=self.scenario)

    def command(self, step: int) -> tuple[float, ...]:
        """The command that begins with this step, from 0; empty where the last one holds."""
        number, rest = divmod(step, self.hold or self.steps + 1)
        rows = self.scenario.controls
        return () if rest or number >= len(rows) else rows[number]


def cases(model: Any, declared: Declarations | None, *, quick: bool) -> tuple[Case, ...]:
    """What happens to a model, declared or by default.

    Raises:
        SceneError: a scenario does not fit the model.
    """
    found = []
    for one in scenes(model, declared, quick=quick):
        what, step = one.scenario, one.own
        steps = whole_number(what.duration, step, "the duration", "the timestep")
        if quick:
            steps = min(steps, max(1, round(QUICK / step)))
        hold = whole_number(what.hold, step, "the hold", "the timestep") if what.hold else 0
        found.append(Case(one.name, what, steps, hold, one.declared is not None))
    if found:
        return tuple(found)
    # In a model in which nothing moves there is nothing to measure, but things to be without.
    step = float(model.opt.timestep)
    return (Case("start", Scenario(10 * step, step), 10),)
