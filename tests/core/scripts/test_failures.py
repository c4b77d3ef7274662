from __future__ import annotations

from coursebuild.core.model.results import Outcome
from coursebuild.core.scripts.extract import Extraction, extract
from coursebuild.core.scripts.failures import failure_diagnostic
from support.sample_lessons import course, describe, document, make_run


def extractions() -> tuple[Extraction, ...]:
    first_lesson = """\
Intro.

```python file=examples/a.py timeout=2.5
import helper

def go():
    helper.fall()
go()
```
"""
    second_lesson = (
        "# x\n\n> ```python file=examples/helper.py\n> def fall():\n>     raise ValueError\n> ```\n"
    )
    return extract(
        course(
            document(first_lesson, "content/lessons/4.2-mass.md"),
            document(second_lesson, "content/lessons/1.1-first.md"),
        )
    ).value


def describe_failure(stderr: str = "", outcome: Outcome = Outcome.FAILED, status: int = 1) -> str:
    scripts = {extraction.path: extraction for extraction in extractions()}
    run = make_run(outcome=outcome, status=status, stderr=stderr)
    diagnostic = failure_diagnostic(scripts["examples/a.py"], run, scripts)
    assert diagnostic is not None
    return f"{diagnostic.span.path}\n{describe(diagnostic)}"


def test_an_exception_group_ends_with_its_last_exception() -> None:
    stderr = (
        "  + Exception Group Traceback (most recent call last):\n"
        '  |   File "/x/examples/a.py", line 5, in <module>\n  |     go()\n'
        "  | ExceptionGroup: two (1 sub-exception)\n  +-+---------------- 1 ----------------\n"
        '    | Traceback (most recent call last):\n    |   File "/x/examples/a.py", line 4, in go\n'
        "    |     helper.fall()\n    | ValueError: bad\n    +------------------------\n"
    )
    assert describe_failure(stderr).split("\n")[1:4] == [
        "script-failed at 7:5 `helper.fall()`",
        "  `examples/a.py` exited with status 1",
        "  ^ ValueError: bad",
    ]


def test_an_exit_without_output_shows_its_status_alone() -> None:
    assert describe_failure("").split("\n")[1:] == [
        "script-failed at 3:1 ````python file=examples/a.py timeout=2.5`",
        "  `examples/a.py` exited with status 1",
    ]


def test_a_syntax_error_and_warnings() -> None:
    stderr = (
        "/x/examples/a.py:4: RuntimeWarning: divide by zero\n  helper.fall()\n"
        "  File \"/x/examples/a.py\", line 5\n    go(\n      ^\nSyntaxError: '(' was never closed\n"
    )
    assert describe_failure(stderr).split("\n")[1:6] == [
        "script-failed at 8:1 `go()`",
        "  `examples/a.py` exited with status 1",
        "  ^ SyntaxError: '(' was never closed",
        "  note: its standard error:",
        "    content/lessons/4.2-mass.md:7: RuntimeWarning: divide by zero",
    ]


def test_a_crash_is_shown_at_the_line_that_its_dump_names_first() -> None:
    stderr = (
        "Fatal Python error: Segmentation fault\n\n"
        "Current thread 0x00007f1200000000 (most recent call first):\n"
        '  File "/x/examples/a.py", line 4 in go\n  File "/x/examples/a.py", line 5 in <module>\n'
    )
    place = describe_failure(stderr, Outcome.KILLED, 11).split("\n")[1]
    assert place == "script-killed at 7:5 `helper.fall()`"


def test_only_extracted_files_are_replaced() -> None:
    unrelated_lines = (
        'File "/x/site-packages/pkg/examples/a.py", line 1',
        'File "/x/examples/b.py", line 1',
        'File "/x/examples/a.py", line 99',
        'File "/x/myexamples/a.py", line 1',
        'File "<string>", line 1',
        "/x/examples/a.py is here",
    )
    lines = describe_failure("\n".join((*unrelated_lines, "/my course/examples/a.py:1: X"))).split(
        "\n"
    )
    assert [line.strip() for line in lines[-7:]] == [
        *unrelated_lines,
        "content/lessons/4.2-mass.md:4: X",
    ]


def test_a_long_standard_error_shows_its_end() -> None:
    text = describe_failure("".join(f"line {i}\n" for i in range(100)))
    assert "its standard error ended with:\n    line 70\n" in text and text.endswith("line 99")
    text = describe_failure("x" * 10_000 + "\x1b[31mred\x1b[0m")
    assert text.endswith("xred") and len(text) < 4500
    assert f"  ^ {'x' * 119}…" in text


def test_a_script_ended_by_a_signal_names_it() -> None:
    for status, name in ((11, "SIGSEGV"), (9, "SIGKILL"), (63, "signal 63")):
        message = f"`examples/a.py` was ended by {name}"
        assert message in describe_failure("", Outcome.KILLED, status).split("\n")[2], status
