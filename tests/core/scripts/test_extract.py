from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from coursebuild.core.model import Document
from coursebuild.core.model.results import ScriptJob
from coursebuild.core.scripts.extract import Extraction, extract, jobs
from support.sample_lessons import course, document, told


def block(path: str, code: str = "pass", keys: str = "") -> str:
    return f"```python file={path} {keys}\n{code}\n```\n"


def lessons(*texts: str, prefix: str = "") -> tuple[Document, ...]:
    return tuple(
        document(text, f"content/lessons/{i}.1-l.md", prefix) for i, text in enumerate(texts, 1)
    )


def test_scripts_become_files() -> None:
    text = (
        "intro\n"
        + block("examples/a.py", "x = 'µ'\n\nprint(x)\n\n\n", "timeout=5")
        + block("examples/b/c.py", keys="norun")
    )
    found = extract(course(*lessons(text)))
    assert found.diagnostics == ()
    a, c = found.value
    assert (a.path, a.text, a.owner, a.document) == (
        "examples/a.py", "x = 'µ'\n\nprint(x)\n", "1.1", "content/lessons/1.1-l.md",
    )  # fmt: skip
    assert a.data == b"x = '\xc2\xb5'\n\nprint(x)\n"
    assert jobs(found.value) == (
        ScriptJob("examples/a.py", (), 5.0, (), False),
        ScriptJob("examples/b/c.py", (), 60.0, (), True),
    )
    assert c.text == "pass\n"


@given(
    st.lists(st.text(alphabet="ab =", max_size=5), max_size=6), st.sampled_from(["", "> ", "  "])
)
def test_every_line_is_the_lesson_s(lines: list[str], prefix: str) -> None:
    code = ["first", *lines, "last"]
    text = "".join(f"{prefix}{line}\n" for line in ("```python file=examples/a.py", *code, "```"))
    (found,) = extract(course(*lessons(text, prefix=prefix))).value
    for number, line in enumerate(code, 1):
        span = found.line_span(number)
        assert span is not None and (span.line, span.text) == (number + 1, line)


def test_a_path_occurs_once() -> None:
    found = extract(course(*lessons(block("examples/a.py", "1"), block("examples/a.py", "2"))))
    assert [e.text for e in found.value] == ["1\n"]
    (clash,) = found.diagnostics
    assert clash.span.path == "content/lessons/2.1-l.md"
    assert clash.notes[0].span is not None
    assert clash.notes[0].span.path == "content/lessons/1.1-l.md"
    assert (
        told(clash)
        == """\
script-repeated at 1:16 `examples/a.py`
  `examples/a.py` is written by two blocks
  note at 1:16 `examples/a.py`: written here first
  help: give one of them another path"""
    )


def test_paths_that_clash() -> None:
    for first, second, message in (
        ("x/a.py", "X/A.py", "`X/A.py` and `x/a.py` are one file where case does not count"),
        (
            "x/\u00e9.py",
            "x/e\u0301.py",
            "`x/e\u0301.py` and `x/\u00e9.py` are one file where case does not count",
        ),
        ("x/a.py", "x/a.py/b.py", "`x/a.py` is a file and cannot be a folder of `x/a.py/b.py`"),
        ("x/a.py/c/b.py", "x/A.py", "`x/A.py` is a file here and a folder of `x/a.py/c/b.py`"),
    ):
        found = extract(course(*lessons(block(first) + block(second))))
        assert [e.path for e in found.value] == [first]
        (clash,) = found.diagnostics
        assert (clash.message, clash.span.text) == (message, second)
        told_places = [(n.message, n.span and n.span.text) for n in clash.notes]
        assert told_places == [(f"`{first}` is written here", first)]


def test_paths_that_do_not_clash() -> None:
    paths = [
        "examples/a.py",
        "examples/a_py/b.py",
        "examples/b/a.py",
        "examples/b.py",
        "examples/ab.py",
    ]
    found = extract(course(*lessons("".join(map(block, paths)))))
    assert ([e.path for e in found.value], found.diagnostics) == (paths, ())
    assert all(isinstance(e, Extraction) for e in found.value)
