"""Largest stable timesteps in words: no digit that is not known."""

from __future__ import annotations

from msgspec.structs import replace

from mjbench.reports.limits import limit_text, stability_text
from mjbench.reports.scene_report import StableRow
from samples.reports import row as setting_row
from samples.reports import scenario

LOW, HIGH = 1.0, 1000.0
ROW = StableRow("RK4", 25.44, (LOW, HIGH), None, 5.0, None, (25.44, 25.48))


def test_only_digits_on_which_spans_and_starts_agree_are_printed() -> None:
    """Theory at rest counts as another limit where it is far above."""
    assert limit_text(ROW) == "25.4 s"
    assert limit_text(replace(ROW, theory=25.2)) == "25 s"
    assert limit_text(replace(ROW, theory=40.0)) == "25.4 s", "that is another limit"
    row = StableRow("RK4", 0.123456, (0.1, 1.0), None, 1.0, None)
    assert limit_text(row) == "120 ms"
    assert limit_text(replace(row, bracket=(0.01075, 0.010779))) == "10.7 ms", "10.8 ms are lost"
    assert limit_text(replace(row, bracket=(0.19998, 0.2))) == "200 ms"


def test_where_digits_do_not_hold_the_least_limit_is_given_and_why() -> None:
    wide = replace(ROW, theory=16.0)
    assert limit_text(wide) == "16 s; from its own start 25 s", "unstable where it comes to rest"
    wide = replace(ROW, bracket=(19.0, 40.0))
    assert limit_text(wide) == "19 s; elsewhere 40 s"
    all_of_own = replace(ROW, largest="all", bracket=(500.0, HIGH))
    assert limit_text(all_of_own) == "500 s; from its own start 1000 s"
    none = replace(ROW, bracket=(0.0, 25.44))
    assert limit_text(none) == "none from every start; from its own 25 s"
    nowhere = replace(ROW, largest="none", bracket=(0.0, 0.0))
    assert limit_text(nowhere) == "none from 1 s on"
    near = StableRow("RK4", 0.056, (0.1, 1.0), None, 1.0, None, (0.05502, 0.05656))
    assert limit_text(near).startswith("55 ms; "), "not 60 ms"
    spiky = replace(near, largest=0.01706, bracket=(0.01551, 0.01706))
    assert limit_text(spiky) == "15 ms; from its own start 17 ms", "a start is lost at 15.7 ms"


def test_the_sentence_tells_which_starts_it_speaks_of() -> None:
    def sentence(**changes: object) -> str:
        row = replace(ROW, near="all", through=None, **changes)
        report = scenario(
            [setting_row("RK4", own=True)], stable=(replace(row, shown=limit_text(row)),)
        )
        return stability_text(report)

    all_steps, near = "every step tried, to 1000 s", "near the motion of small steps"
    assert sentence(largest="all", bracket=None) == f"RK4 stays bounded and {near} at {all_steps}"
    text = f"RK4 stays bounded from every start at the steps tried to 19 s; {near} from its own "
    text += f"at {all_steps}"
    assert sentence(largest="all", bracket=(19.0, HIGH)) == text
    text = f"RK4 stays bounded from every start at no step from 1 s on; {near} from its own at "
    assert sentence(largest="all", bracket=(0.0, HIGH)) == f"{text}{all_steps}"


def test_where_limits_have_islands_two_digits_are_known() -> None:
    assert limit_text(replace(ROW, islands=(60.0, 80.0))) == "25 s"
