"""Numbers of the hard cases that are changed by a millionth, one at a time."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

from benchmarks.slips.constants import numbers_of
from support.fixture_cases import fixture_text

ROOT = Path(__file__).resolve().parents[2]
MODULE = fixture_text("scripts/mutated_module.txt")


def test_numbers_of_a_module_and_why_some_are_left_alone() -> None:
    reasons = {number.text: number.reason for number in numbers_of("cases", ast.parse(MODULE))}
    assert {text for text, reason in reasons.items() if not reason} == {
        *("0.2", "2", "0.5", "20", "4.0", "0.25")
    }
    assert {text: reason for text, reason in reasons.items() if reason} == {
        **dict.fromkeys(("0.001", "50.0", "1.5", "0.1"), "time that is tried"),
        "9": "end of an iteration",
        "1e-09": "allowed difference",
    }


@pytest.mark.site
def test_a_sample_of_numbers_is_judged() -> None:
    options = "tumbling_box --cases tumbling-box --every 9 --list caught".split()
    command = [sys.executable, "benchmarks/mutations.py", *options]
    run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert run.returncode == 0, run.stdout + run.stderr
    assert run.stdout.count("caught: tumbling_box.py:") >= 3
