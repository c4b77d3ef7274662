from __future__ import annotations

from coursebuild.core.model.results import Outcome
from coursebuild.core.scripts.compare import verify
from coursebuild.core.scripts.extract import extract
from coursebuild.core.scripts.findings import script_findings
from support.sample_lessons import course, document, ran, told

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


def test_where_only_some_scripts_ran_the_others_are_known() -> None:
    stderr = (
        'Traceback (most recent call last):\n  File "/x/examples/a.py", line 1, in <module>\n'
        '  File "/x/examples/b.py", line 2, in <module>\nZeroDivisionError: division by zero\n'
    )
    here = course(document(LESSON))
    chosen = extract(here).value[:1]
    runs = [ran(outcome=Outcome.FAILED, status=1, stderr=stderr)]
    (found,) = script_findings(here, chosen, runs, verify(here, runs))
    assert told(found).startswith("script-failed at 15:1 `1/0`")
    assert script_findings(here, chosen, [ran("E 1.5")], verify(here, [ran("E 1.5")])) == ()


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
    here = course(document(text))
    runs = (ran("one\n"), ran("1.52\n", path="examples/b.py"))
    assert [v.status for v in verify(here, runs)] == ["verified", "volatile", "verified"]
    assert [v.status for v in verify(here, runs[:1])] == ["verified", "volatile", "unchecked"]
    failed = (ran("one\n", outcome=Outcome.FAILED, status=1), ran("", path="examples/b.py"))
    assert [v.status for v in verify(here, failed)] == ["unchecked"] * 3
