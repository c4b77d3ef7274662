from __future__ import annotations

import pytest

from coursebuild.core.model import Comparison
from coursebuild.core.scripts.bindings import Printed, leaning_on
from coursebuild.core.scripts.compare import compare, verify
from coursebuild.core.scripts.findings import drift_diagnostic
from coursebuild.core.text.diagnostics import Diagnostic
from support.sample_lessons import EXACT, course, document, ran, recording, told


def drift(recorded: str, printed: str, comparison: Comparison = EXACT) -> Diagnostic:
    return drift_diagnostic(compare(recording(recorded), comparison, (), printed), "4.2")


def test_the_whole_report() -> None:
    text = """\
```python file=examples/a.py
print(1)
```

Output:

```text
RK4     energy  -0.000 %  3.9e-11
Euler   energy  +6.641 %  6.9e-04
implicit        -6.040 %  6.4e-04
0 and 4 flips
```

It gains `+6.6 %`{out} and loses `−6.0 %`{out}; `3.9e-11`{out}; flips `4`{out=examples/a.py}.
"""
    lesson = document(text)
    runs = [
        ran(
            text[text.index("RK4") : text.index("```\n\nIt")]
            .replace("+6.641", "+6.702")
            .replace("6.040", "6.041")
            .replace("4 flips", "5 flips")
        )
    ]
    (verdict,) = verdicts = verify(course(lesson), runs)
    leaning = leaning_on(verdict, [lesson], Printed(verdicts, runs))
    assert (
        told(drift_diagnostic(verdict, "4.2", leaning))
        == """\
output-drift at 9:17 `+6.641`
  recorded output differs from this run
  ^ this run printed +6.702 (relative error 9.2e-03, 2 digits agree)
  note at 10:17 `-6.040`: recorded -6.040; \
this run printed -6.041 (relative error 1.7e-04, 3 digits agree)
  note at 11:7 `4`: recorded 4; this run printed 5 (relative error 2.5e-01, no digit agrees)
  note: rounding: 1, numeric: 2
  note: recorded against this run:
    --- recorded
    +++ this run
    @@ -1,4 +1,4 @@
     RK4     energy  -0.000 %  3.9e-11
    -Euler   energy  +6.641 %  6.9e-04
    -implicit        -6.040 %  6.4e-04
    -0 and 4 flips
    +Euler   energy  +6.702 %  6.9e-04
    +implicit        -6.041 %  6.4e-04
    +0 and 5 flips
  note at 14:11 `+6.6 %`: `+6.6 %` leans on +6.641, which this run printed as +6.702
  note at 14:35 `−6.0 %`: `−6.0 %` leans on -6.040, \
which this run printed as -6.041, and still holds
  note at 14:72 `4`: `4` leans on 4, which this run printed as 5
  help: if the change is intended, run `coursebuild update 4.2`"""
    )


@pytest.mark.parametrize(
    ("recorded", "printed", "label"),
    [
        ("E 6.641", "E 6.702", "this run printed 6.702 (relative error 9.2e-03, 2 digits agree)"),
        ("E 1.0", "E 1.5", "this run printed 1.5 (relative error 5.0e-01, no digit agrees)"),
        ("E 1.00", "E 1.05", "this run printed 1.05 (relative error 5.0e-02, 1 digit agrees)"),
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


def test_further_differences_say_what_was_recorded() -> None:
    found = drift("x 1\na red b\nc d\nlost one", "x 2\na blue b\nc e d\n")
    assert [note.message for note in found.notes][:3] == [
        "recorded `red`; this run printed `blue`",
        "this run printed `e`",
        "recorded `lost one`; this run did not print this line",
    ]


def test_long_reports_are_summarised() -> None:
    lines = "\n".join(f"row {i} = {i}.5" for i in range(40))
    found = drift(lines, lines.replace(".5", ".7"))
    named = [note for note in found.notes if note.span is not None]
    assert len(named) == 20
    assert [n.message.split("\n")[0] for n in found.notes if n.span is None] == [
        "and 19 more differences",
        "numeric: 40",
        "recorded against this run:",
    ]
    one_more = drift(*(("\n".join(f"r {i}.5{end}" for i in range(22))) for end in ("", "5")))
    assert "and 1 more difference" in [note.message for note in one_more.notes]
