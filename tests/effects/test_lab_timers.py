"""Timers for lab code, in a V8 that has none of its own."""

from __future__ import annotations

from pathlib import Path

import pytest

from coursebuild.effects import lab_files
from coursebuild.effects.v8 import Isolate
from support.lab_values import Bench, make_lab
from support.runners import wait_until

pytestmark = pytest.mark.engine

TIMERS = Path(lab_files.__file__).with_name("lab_timers.js").read_text(encoding="utf-8")
SCRIPT = """
const told = []
const tell = (...words) => told.push(...words)
setTimeout(tell, 400, 'late', 'and more')
setTimeout(tell, 0, 'soon')
setTimeout(tell)
setTimeout(tell, Infinity, 'at once')
clearTimeout(setTimeout(tell, 20, 'never'))
clearTimeout(undefined)
tell('now')
const seen = () => String(told)
"""


def test_actions_come_when_their_time_is_over_unless_they_were_taken_back() -> None:
    isolate = Isolate(TIMERS, SCRIPT)
    try:
        wait_until(lambda: "late" in isolate.call("seen", "", 120.0), "the late one")
        seen = isolate.call("seen", "", 120.0)
        assert seen == "now,soon,at once,late,and more"
    finally:
        isolate.close()


def test_each_has_a_number_of_its_own() -> None:
    numbers = "const numbers = () => String([1, 2, 3].map(() => setTimeout(() => {}, 1)))"
    isolate = Isolate(TIMERS, numbers)
    try:
        assert isolate.call("numbers", "", 120.0) == "1,2,3"
    finally:
        isolate.close()


def test_a_lab_that_sets_one_is_told(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    with bench.browser, bench.native:
        for code in ("setTimeout(() => {}, 10)", "ctx.later = setTimeout(() => {})"):
            (failure,) = bench.trial(make_lab(setup=code))["failures"]
            assert (failure["kind"], failure["entry"]) == ("shared", ["setup"])
        assert bench.trial(make_lab(setup="ctx.can = typeof setTimeout"))["failures"] == []
