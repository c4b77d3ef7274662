"""Scripts as files, and what is said of their runs: failures, drift, texts without a run."""

from __future__ import annotations

from coursebuild.core.model import Course
from coursebuild.core.model.results import Outcome, ScriptJob
from coursebuild.core.scripts.compare import verify
from coursebuild.core.scripts.extract import Extraction, extract, jobs
from coursebuild.core.scripts.failures import failure_diagnostic
from coursebuild.core.scripts.findings import script_findings
from support.fixture_cases import FIXTURES, Case, check_cases, fixture_text
from support.sample_lessons import course, describe, document, make_run


def block(path: str, code: str = "pass", keys: str = "") -> str:
    return f"```python file={path} {keys}\n{code}\n```\n"


def course_of(text: str) -> Course:
    return course(document(text, "content/lessons/1.1-l.md"))


def test_scripts_become_files() -> None:
    text = (
        "intro\n"
        + block("examples/a.py", "x = 'µ'\n\nprint(x)\n\n\n", "timeout=5")
        + block("examples/b/c.py", keys="norun")
    )
    extraction = extract(course_of(text))
    assert extraction.diagnostics == ()
    a, c = extraction.value
    assert (a.path, a.text, a.owner, a.document) == (
        "examples/a.py", "x = 'µ'\n\nprint(x)\n", "1.1", "content/lessons/1.1-l.md",
    )  # fmt: skip
    assert a.data == b"x = '\xc2\xb5'\n\nprint(x)\n"
    assert jobs(extraction.value) == (
        ScriptJob("examples/a.py", (), 5.0, ()),
        ScriptJob("examples/b/c.py", (), 60.0, ()),
    )
    assert c.text == "pass\n"
    places = [a.line_span(number) for number in range(5)]
    assert [place and (place.line, place.text) for place in places] == [
        None,
        (3, "x = 'µ'"),
        (4, ""),
        (5, "print(x)"),
        None,
    ]


def test_paths_that_clash() -> None:
    message = "`{two}` and `{one}` cannot both be written everywhere"
    for first, second in (
        ("é.py", "e\u0301.py"),
        ("a.py", "a.py/b.py"),
        ("a.py/c/b.py", "A.py"),
    ):
        first, second = f"examples/{first}", f"examples/{second}"
        extraction = extract(course_of(block(first) + block(second)))
        assert [e.path for e in extraction.value] == [first]
        (clash,) = extraction.diagnostics
        assert (clash.message, clash.span.text) == (message.format(one=first, two=second), second)
        notes = [(n.message, n.span and n.span.text) for n in clash.notes]
        assert notes == [(f"`{first}` is written here", first)]
    neighbours = ["examples/a.py", "examples/a_py/b.py", "examples/b/a.py", "examples/b.py"]
    assert extract(course_of("".join(map(block, neighbours)))).diagnostics == ()


LESSON = fixture_text("documents/findings.md")


def test_tracebacks_lead_into_scripts_that_did_not_run() -> None:
    stderr = (
        'Traceback (most recent call last):\n  File "/x/examples/a.py", line 1, in <module>\n'
        '  File "/x/examples/b.py", line 2, in <module>\nZeroDivisionError: division by zero\n'
    )
    lessons = course(document(LESSON))
    scripts = extract(lessons).value[:1]
    runs = [make_run(outcome=Outcome.FAILED, status=1, stderr=stderr)]
    (diagnostic,) = script_findings(
        lessons, lessons.owned_documents, scripts, runs, verify(lessons, runs)
    )
    assert describe(diagnostic).startswith("script-failed at 15:1 `1/0`")
    assert (
        script_findings(
            lessons,
            lessons.owned_documents,
            scripts,
            [make_run("E 1.5")],
            verify(lessons, [make_run("E 1.5")]),
        )
        == ()
    )


def test_every_recording_gets_a_verdict() -> None:
    text = fixture_text("documents/verdicts.md")
    lessons = course(document(text))
    runs = (make_run("one\n"), make_run("1.52\n", path="examples/b.py"))
    assert [v.status for v in verify(lessons, runs)] == ["verified", "volatile", "verified"]
    assert [v.status for v in verify(lessons, runs[:1])] == ["verified", "volatile", "unchecked"]
    failed_runs = (
        make_run("one\n", outcome=Outcome.FAILED, status=1),
        make_run("", path="examples/b.py"),
    )
    assert [v.status for v in verify(lessons, failed_runs)] == ["unchecked"] * 3


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


def test_failures_are_told_with_their_places(rewriting: bool) -> None:
    def render(case: Case) -> str:
        outcome, status = case.input.split("\n")[0].split()
        stderr = case.input.partition("\n")[2]
        return describe_failure(stderr, Outcome(outcome), int(status)) + "\n"

    check_cases(FIXTURES / "scripts/failures.md", render, rewriting=rewriting)


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
