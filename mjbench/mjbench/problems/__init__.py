"""The hard cases, those of a kind in a module."""

from __future__ import annotations

from functools import cache

from mjbench.problem import Problem
from mjbench.problems import (
    contacts,
    extremes,
    impact,
    linked_bodies,
    oscillators,
    tops,
    tumbling_box,
)


@cache
def all_problems() -> dict[str, Problem]:
    """Every hard case by its name, in the order of their numbers."""
    problems = (
        tumbling_box.problem(),
        *tops.problems(),
        *contacts.problems(),
        *impact.problems(),
        *linked_bodies.problems(),
        *oscillators.problems(),
        *extremes.problems(),
    )
    return {problem.name: problem for problem in sorted(problems, key=lambda problem: problem.case)}
