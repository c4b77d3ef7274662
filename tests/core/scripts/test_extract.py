from __future__ import annotations

from coursebuild.core.model import Course
from coursebuild.core.model.results import ScriptJob
from coursebuild.core.scripts.extract import extract, jobs
from support.sample_lessons import course, document


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
    for first, second, message in (
        ("é.py", "e\u0301.py", "`{two}` and `{one}` are one file where case does not count"),
        ("a.py", "a.py/b.py", "`{one}` is a file and cannot be a folder of `{two}`"),
        ("a.py/c/b.py", "A.py", "`{two}` is a file here and a folder of `{one}`"),
    ):
        first, second = f"examples/{first}", f"examples/{second}"
        extraction = extract(course_of(block(first) + block(second)))
        assert [e.path for e in extraction.value] == [first]
        (clash,) = extraction.diagnostics
        assert (clash.message, clash.span.text) == (
            message.format(one=first, two=second),
            second,
        )
        notes = [(n.message, n.span and n.span.text) for n in clash.notes]
        assert notes == [(f"`{first}` is written here", first)]
    neighbours = ["examples/a.py", "examples/a_py/b.py", "examples/b/a.py", "examples/b.py"]
    assert extract(course_of("".join(map(block, neighbours)))).diagnostics == ()
