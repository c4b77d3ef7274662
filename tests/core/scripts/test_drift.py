from __future__ import annotations

import pytest

from coursebuild.core.model import Comparison
from coursebuild.core.scripts.compare import compare
from coursebuild.core.scripts.findings import drift_diagnostic
from coursebuild.core.text.diagnostics import Diagnostic
from coursebuild.report.text import Style, diagnostic_text
from support.sample_lessons import EXACT, recording


def drift(recorded: str, printed: str, comparison: Comparison = EXACT) -> Diagnostic:
    return drift_diagnostic(compare(recording(recorded), comparison, printed), "4.2")


@pytest.mark.parametrize(
    ("recorded", "printed", "label"),
    [
        ("E 6.641", "E 6.702", "this run printed 6.702 (relative error 9.2e-03, 2 digits agree)"),
        ("E 1.0", "E 1.5", "this run printed 1.5 (relative error 5.0e-01, no digit agrees)"),
        ("E 1.00", "E 1.05", "this run printed 1.05 (relative error 5.0e-02, 1 digit agrees)"),
        ("E 1.00", "E 1.01", "this run printed 1.01 (relative error 1.0e-02, 2 digits agree)"),
        ("E 0.0", "E 1.5", "this run printed 1.5"),
        ("E 1.0", "E nan", "this run printed nan"),
        ("E 1e-9", "E 1e500", "this run printed 1e500"),
        ("E 1.0", "E 1.00", "this run printed 1.00 (the same value, written in another way)"),
        ("a red b", "a blue b", "this run printed `blue`"),
        ("a red b", "a b", "this run printed nothing here"),
        ("a b", "a red b", "this run printed `red`"),
        ("a   b", "a b", "this run printed white space of another width here"),
        ("a\nb c d", "a", "this run did not print this line"),
        ("a\nb\nc", "a", "this run did not print these 2 lines"),
        ("a", "a\nb", "this run printed `b` here"),
        ("a", "a\nb\nc", "this run printed `b` and 1 more line here"),
        ("a", "a\nb\nc\nd", "this run printed `b` and 2 more lines here"),
        ("a", "b" * 99, f"this run printed `{'b' * 59}…`"),
    ],
)
def test_labels(recorded: str, printed: str, label: str) -> None:
    assert drift(recorded, printed).label == label


def test_a_drift_is_reported_in_ten_lines() -> None:
    lines = "\n".join(f"row {i} = {i}.5" for i in range(40))
    diagnostic = drift(lines, lines.replace(".5", ".7"))
    assert diagnostic.message == "recorded output differs from this run (numeric: 40)"
    assert [note.message for note in diagnostic.notes] == [
        "recorded 1.5; this run printed 1.7 (relative error 1.3e-01, no digit agrees)",
        "recorded 2.5; this run printed 2.7 (relative error 8.0e-02, 1 digit agrees)",
        "recorded 3.5; this run printed 3.7 (relative error 5.7e-02, 1 digit agrees)",
        "and 36 more differences",
    ]
    assert len(diagnostic_text(diagnostic, Style()).split("\n")) == 10
