"""The hard cases, one module each.

Entry points: `all_problems()`, `problem_names()`, `problem_named(name)`.
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
def all_problems() -> tuple[Problem, ...]:
    """Every hard case, by its number."""
    found = (
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
    return tuple(sorted(found, key=lambda problem: problem.case))


def problem_names() -> tuple[str, ...]:
    """Their names, in that order."""
    return tuple(problem.name for problem in all_problems())


def problem_named(name: str) -> Problem:
    """The problem of this name.

    Raises:
        KeyError: there is none.
    """
    return {problem.name: problem for problem in all_problems()}[name]
