"""Largest stable timesteps as pages show them: no digit that is not known, and what is not seen."""

from __future__ import annotations

from msgspec.structs import replace

from coursebuild.core.model.measurements import StableRow
from coursebuild.features.bench.commands.measurement import english
from coursebuild.features.bench.scenario_view import (
    missed_islands,
    stable_again,
    stable_cells,
    stable_title,
)
from coursebuild.features.bench.shown_errors import limit_text, map_text

LOW, HIGH = 1.0, 1000.0
ROW = StableRow("RK4", 25.44, (LOW, HIGH), None, 5.0, 1, 9, None, (25.44, 25.48))
TRIES = ((10.0, 10, 0), (11.5, 10, 0), (13.0, 10, 0), (24.0, 10, 3), (24.55, 10, 10))
GRID = (9.0, 10.35, 11.9, *(13.0 * 1.0227**n for n in range(30)))
"""A step of 15 % below half the limit, and of 2.3 % above."""


def test_only_digits_on_which_spans_and_starts_agree_are_printed() -> None:
    """Theory at rest counts as another limit where it is far above."""
    assert limit_text(ROW) == "25.4 s"
    assert limit_text(replace(ROW, theory=25.2)) == "25 s"
    assert limit_text(replace(ROW, theory=16.0)) == "16 s – 25 s", "unstable where it comes to rest"
    assert limit_text(replace(ROW, theory=40.0)) == "25.4 s", "that is another limit"
    assert limit_text(replace(ROW, bracket=(19.0, 25.4))) == "19 s – 25 s"
    assert limit_text(replace(ROW, largest=None, bracket=(500.0, HIGH))) == "500 s – 1000 s"
    row = StableRow("RK4", 0.123456, (0.1, 1.0), None, 1.0, 8, 8, None)
    assert limit_text(row) == "120 ms"
    assert limit_text(replace(row, bracket=(0.05502, 0.05656))) == "55 ms – 57 ms", "not 60 ms"
    assert limit_text(replace(row, bracket=(0.01075, 0.010779))) == "10.7 ms", "10.8 ms are lost"
    assert limit_text(replace(row, bracket=(0.19998, 0.2))) == "200 ms"


def test_a_map_has_a_sign_for_each_timestep() -> None:
    assert map_text(replace(ROW, tries=TRIES)) == "10 s ···∘• 25 s"
    assert map_text(replace(ROW, tries=TRIES[:3])) == "", "nothing was lost"


def test_what_the_gaps_between_timesteps_may_hide_is_said() -> None:
    """Where limits have islands, their digits are no finer than the gaps."""
    row = replace(ROW, islands=(60.0, 80.0), tries=tuple((step, 10, 0) for step in GRID))
    assert limit_text(row) == "25 s"
    assert missed_islands(english(), [row]) == [
        "Islands of lost timesteps can be missed if they are narrower than 2.3 %, or than 15 % "
        "below half the limit."
    ]
    assert missed_islands(english(), [replace(row, tries=())]) == []
    assert stable_again(english(), row) == "some are stable again, from 60 s to 80 s"
    assert stable_again(english(), replace(row, islands=(0.05,) * 2)) == (
        "one is stable again: 50 ms"
    )


def test_a_table_says_all_times_over_which_its_timesteps_are_stable() -> None:
    rows = [replace(ROW, duration=time) for time in (4.0, 2785.2, 4.0)]
    assert stable_title(english(), rows) == "Largest stable timesteps over 4 s – 2790 s"


def test_energy_that_is_gained_at_the_shortest_timestep_may_be_gained_below() -> None:
    assert stable_cells(english(), replace(ROW, gain=(LOW, 8.0)))[3].startswith("from ≤ 1 s")
    assert "≤" not in stable_cells(english(), replace(ROW, gain=(20.0, 8.0)))[3]
