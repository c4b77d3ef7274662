"""Every recording of a course gets its verdict."""

from __future__ import annotations

from coursebuild.core.model.results import Outcome
from coursebuild.core.scripts.compare import verify
from support.sample_lessons import (
    DIGITS,
    course,
    document,
    ran,
)


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


def test_the_course_s_comparison_is_the_default() -> None:
    text = "```python file=examples/a.py\n1\n```\n\nOutput:\n\n```text\n1.5\n```\n"
    (found,) = verify(course(document(text), comparison=DIGITS), (ran("1.52"),))
    assert (found.status, found.comparison) == ("verified", DIGITS)
