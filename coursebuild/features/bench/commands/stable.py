"""Largest stable timesteps as text, of models and of hard cases.

Entry points: `stable_cells(row)` under `STABLE`; `stable_meaning(row)`, what is called stable;
`stable_again(rows)`, where it is not monotone.
"""

from __future__ import annotations

from collections.abc import Sequence

from coursebuild.numerics.reports.bench import StableRow
from coursebuild.numerics.reports.text import seconds_text
from coursebuild.report.terminal import visible

STABLE = ("largest stable", "steps", "tried")


def stable_cells(row: StableRow) -> tuple[str, str, str]:
    """A largest stable timestep, the steps of a run with it, and what was tried up to it."""
    low, high = (seconds_text(step, 3) for step in row.searched)
    if row.largest is None:
        return f"all to {high}", str(row.steps), f"{row.tried} from {low}"
    if row.largest == 0:
        return f"none from {low}", str(row.steps), ""
    return seconds_text(row.largest), str(row.steps), f"{row.tried} from {low}"


def stable_meaning(row: StableRow) -> str:
    """What is called stable."""
    energy = "energy is not judged" if row.energy is None else f"at most {row.energy:.3g} J"
    return f"stable over {seconds_text(row.duration)}; {energy}"


def stable_again(rows: Sequence[StableRow]) -> list[str]:
    """Where timesteps beyond the largest are stable again, a line for each integrator."""
    return [
        f"{visible(row.integrator)} is not monotone: some are stable again, "
        f"from {seconds_text(row.islands[0], 4)} to {seconds_text(row.islands[1], 4)}"
        for row in rows
        if row.islands is not None
    ]
