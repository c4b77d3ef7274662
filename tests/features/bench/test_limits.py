"""Largest stable timesteps as pages show them, and what the search for them does not see."""

from __future__ import annotations

from msgspec.structs import replace

from coursebuild.core.files.resources import template_texts
from coursebuild.core.model.measurements import StableRow
from coursebuild.core.pages.materials import strings_for
from coursebuild.features.bench.scenario_view import stable_again, stable_cells, stable_title

WORDS = strings_for(template_texts(), "en")
ROW = StableRow("RK4", 25.44, (1.0, 1000.0), None, 5.0, None, shown="25.4 s")


def test_a_table_says_all_times_over_which_its_timesteps_are_stable() -> None:
    rows = [replace(ROW, duration=time) for time in (4.0, 2785.2, 4.0)]
    assert stable_title(WORDS, rows) == "Largest stable timesteps over 4 s – 2790 s"


def test_what_stays_near_and_what_goes_through_has_columns_of_its_own() -> None:
    row = replace(ROW, near=7.04, through="all", theory="none")
    assert stable_cells(WORDS, row)[:4] == ("25.4 s", "7 s", "all up to 1000 s", "none")
    assert stable_cells(WORDS, ROW)[1:4] == ("", "", ""), "not measured"
    lost = replace(ROW, largest="none", near="none")
    assert stable_cells(WORDS, lost)[:2] == ("none from 1 s on",) * 2


def test_larger_timesteps_that_are_stable_again_are_told() -> None:
    row = replace(ROW, islands=(60.0, 80.0))
    assert stable_again(WORDS, row) == "some are stable again, from 60 s to 80 s"
    assert stable_again(WORDS, replace(row, islands=(0.05,) * 2)) == "one is stable again: 50 ms"
