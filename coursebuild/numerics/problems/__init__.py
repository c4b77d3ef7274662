"""The hard cases, one module each.

Entry point: `all_problems()`.
"""

from __future__ import annotations

from functools import cache

from coursebuild.numerics.problem import Problem
from coursebuild.numerics.problems import (
    chains,
    double_pendulum,
    impact,
    incline,
    oscillators,
    pendulum,
    projectile,
    scales,
    stack,
    tops,
    tumbling_box,
)


@cache
def all_problems() -> dict[str, Problem]:
    """Every hard case by its name, in the order of their numbers."""
    problems = (
        tumbling_box.problem(),
        *pendulum.problems(),
        *tops.problems(),
        projectile.problem(),
        *incline.problems(),
        *impact.problems(),
        *stack.problems(),
        double_pendulum.problem(),
        *chains.problems(),
        *oscillators.problems(),
        *scales.problems(),
    )
    return {problem.name: problem for problem in sorted(problems, key=lambda problem: problem.case)}
