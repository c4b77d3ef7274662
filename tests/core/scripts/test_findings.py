from __future__ import annotations

from coursebuild.core.model.results import Outcome
from coursebuild.core.scripts.compare import verify
from coursebuild.core.scripts.edit import apply_edits
from coursebuild.core.scripts.extract import extract
from coursebuild.core.scripts.findings import script_findings
from support.sample_lessons import course, describe, document, make_run

LESSON = """\
```python file=examples/a.py
import b
```

Output:

```text
E 1.5
```

See `1.5`{out} and `7.0`{out=examples/b.py}.

```python file=examples/b.py
print(7)
1/0
```
"""


def test_tracebacks_lead_into_scripts_that_did_not_run() -> None:
    stderr = (
        'Traceback (most recent call last):\n  File "/x/examples/a.py", line 1, in <module>\n'
        '  File "/x/examples/b.py", line 2, in <module>\nZeroDivisionError: division by zero\n'
    )
    lessons = course(document(LESSON))
    scripts = extract(lessons).value[:1]
    runs = [make_run(outcome=Outcome.FAILED, status=1, stderr=stderr)]
    (diagnostic,) = script_findings(lessons, scripts, runs, verify(lessons, runs))
    assert describe(diagnostic).startswith("script-failed at 15:1 `1/0`")
    assert (
        script_findings(lessons, scripts, [make_run("E 1.5")], verify(lessons, [make_run("E 1.5")]))
        == ()
    )


def test_a_text_that_resembles_an_output_is_mended_by_its_edit() -> None:
    for block in (
        "```\nE 1.52 of 3\n```",
        "~~~~ txt\nE 1.52 of 3\n~~~~",
        "> ```text\n> E 1.52 of 3\n> ```",
    ):
        lessons = course(document("```python file=examples/a.py\n1\n```\n\nSee this.\n\n" + block))
        runs = [make_run("E 1.25 of 3")]
        scripts = extract(lessons).value
        (diagnostic,) = script_findings(lessons, scripts, runs, verify(lessons, runs))
        assert diagnostic.rule == "output-unmarked"
        lessons = course(document(apply_edits(lessons.documents[0].source.text, diagnostic.edits)))
        (diagnostic,) = script_findings(lessons, scripts, runs, verify(lessons, runs))
        assert describe(diagnostic).startswith("output-drift")


def test_every_recording_gets_a_verdict() -> None:
    text = """\
```python file=examples/a.py
1
```

Output:

```text
one
```

Output:

```text volatile
two
```

```python file=examples/b.py
2
```

Output:

```text digits
1.5
```
"""
    lessons = course(document(text))
    runs = (make_run("one\n"), make_run("1.52\n", path="examples/b.py"))
    assert [v.status for v in verify(lessons, runs)] == ["verified", "volatile", "verified"]
    assert [v.status for v in verify(lessons, runs[:1])] == [
        "verified",
        "volatile",
        "unchecked",
    ]
    failed_runs = (
        make_run("one\n", outcome=Outcome.FAILED, status=1),
        make_run("", path="examples/b.py"),
    )
    assert [v.status for v in verify(lessons, failed_runs)] == ["unchecked"] * 3
