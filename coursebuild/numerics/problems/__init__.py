"""The hard cases, one module each.

Entry points: `all_problems()`, `problem_names()`, `problem_named(name)`.
"""

from __future__ import annotations

from functools import cache

from coursebuild.numerics.problem import Problem
from coursebuild.numerics.problems import (
    chains,
    damped_spring,
    double_pendulum,
    heavy_top,
    impact,
    incline,
    pendulum,
    projectile,
    scales,
    soft_equality,
    stack,
    stiff_servo,
    tops,
    touching_cradle,
    tumbling_box,
)


@cache
def all_problems() -> tuple[Problem, ...]:
    """Every hard case, by its number."""
    return (
        tumbling_box.problem(),
        *pendulum.problems(),
        *tops.problems(),
        heavy_top.problem(),
        projectile.problem(),
        *damped_spring.problems(),
        *stiff_servo.problems(),
        *incline.problems(),
        *impact.problems(),
        touching_cradle.problem(),
        *stack.problems(),
        double_pendulum.problem(),
        *chains.problems(),
        *soft_equality.problems(),
        *scales.problems(),
    )


def problem_names() -> tuple[str, ...]:
    """Their names, in that order."""
    return tuple(problem.name for problem in all_problems())


def problem_named(name: str) -> Problem:
    """The problem of this name.

    Raises:
        KeyError: there is none.
    """
    return {problem.name: problem for problem in all_problems()}[name]
