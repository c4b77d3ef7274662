"""The sections of pages for the search, and the files of them that a browser loads."""

from __future__ import annotations

import json

import pytest

from coursebuild.core.pages.library import Library
from coursebuild.core.pages.page_inputs import PageInputs
from coursebuild.core.pages.page_list import page_list
from coursebuild.features.search.page import (
    Section,
    SectionPiece,
    SectionReader,
    note_page,
    page_sections,
    text_and_terms,
    weigh_terms,
)
from support.rendered_course import Make

LESSON = """Before any *heading*, at $I_{xx}$.[^n]

## Outer {#out}

- One `mj_step` item
- Two

> [!warning] Mind
> In a [callout](lesson:1.1).

### Inner <b>bold</b>

$$
\\tau = \\dot{L}
$$

| h | k |
| - | - |
| a | $b$ |

```python file=examples/a.py norun
import mujoco
```

```quiz
{"id": "q", "title": "Check", "questions": [
  {"kind": "mcq", "q": "Which <b>one</b>?", "options": ["This", "That"], "answer": 1,
   "explain": "The secret.", "hints": ["A secret hint."]},
  {"kind": "order", "q": "Sort", "items": ["zeta", "alpha"]}
]}
```

## Empty

<div>raw <i>text</i> &amp; more<script>hidden()</script></div>

[^n]: A *note*.
"""


def sections_of(make: Make, text: str) -> tuple[Section, ...]:
    rendered_course = make(text)
    library = rendered_course.library()
    document = library.lessons["0.1"].document
    return page_sections(inputs_of(library, "lesson", "0.1"), document, "")


def inputs_of(library: Library, kind: str, id: str = "") -> PageInputs:
    of_kind = (page for page in page_list(library) if page.kind == kind)
    pages = (page for page in of_kind if id in ("", page.id))
    return next(pages).inputs(library)


def pieces(section: Section) -> list[tuple[str, str]]:
    return [(piece.kind, piece.text) for piece in section.pieces]


def test_a_lesson_by_its_sections(make: Make) -> None:
    sections = sections_of(make, LESSON)
    heads = [(s.anchor, s.heading, s.level) for s in sections]
    assert heads == [
        ("", "", 0),
        ("out", "Outer", 2),
        ("inner-bold", "Inner bold", 3),
        ("empty", "Empty", 2),
    ]
    start, outer, inner, empty = sections
    assert pieces(start) == [
        ("text", "A body falls."),
        ("text", "free fall, drop"),
        ("text", "Say what falls"),
        ("text", "Measure it"),
        ("text", "Before any heading, at I_xx."),
    ]
    assert pieces(outer) == [
        ("text", "One mj_step item"),
        ("text", "Two"),
        ("text", "Warning: Mind"),
        ("text", "In a callout."),
    ]
    assert pieces(inner)[:4] == [
        ("formula", "τ = L"),
        ("text", "h | k"),
        ("text", "a | b"),
        ("code", "import mujoco"),
    ]
    assert inner.names == ("dot", "examples/a.py")
    assert pieces(empty) == [("text", "raw text & more"), ("text", "A note.")]


def test_a_quiz_gives_no_answer_away(make: Make) -> None:
    texts = [text for section in sections_of(make, LESSON) for _, text in pieces(section)]
    at = texts.index("Check")
    assert texts[at + 1 : at + 7] == ["Which one?", "This", "That", "Sort", "alpha", "zeta"]
    assert not any("secret" in text for text in texts)


def test_pages_that_are_searched_and_that_are_not(make: Make) -> None:
    rendered_course = make("Text.")
    library = rendered_course.library()
    for kind in ("home", "notfound", "search", "offline", "progress"):
        assert note_page(inputs_of(library, kind), None, "<p>Text</p>") == b"", kind
    planned = inputs_of(library, "lesson", "1.2")
    assert page_sections(planned, None, "<p>Other</p>") == (
        Section("", "", 0, (SectionPiece("text", "Comes later."),)),
    )
    assert b"Lessons" not in note_page(inputs_of(library, "level", "0"), None, "<p>Lessons</p>")
    model = page_sections(inputs_of(library, "model", "box"), None, "<h2 id='x'>Facts</h2>")
    assert model[0].pieces[-1].text.startswith('<mujoco model="box">')
    assert model[1] == Section("x", "Facts", 2, ())


def test_terms_have_weights_by_place_and_frequency(make: Make) -> None:
    piece = SectionPiece("text", "body body body body; inertia")
    code = SectionPiece("code", "body mj_step " + "x1 " * 10 + "y1 " * 9 + "z1 " * 4 + "w1 " * 3)
    sections = (Section("a", "Inertia", 2, (piece, code), ("frac",)),)
    lines = weigh_terms(["4.2", "Body"], sections).decode().split("\n")
    assert lines == sorted(lines, key=lambda line: line[1:])
    assert {line[1:]: line[0] for line in lines} == {
        "4.2": "c",
        "body": "e",
        "inertia": "9",
        "frac": "0",
        "mj_step": "0",
        "mjstep": "0",
        "mj": "0",
        "step": "0",
        "x1": "3",
        "y1": "2",
        "z1": "2",
        "w1": "1",
    }


def test_the_text_of_a_page_is_in_plain_values(make: Make) -> None:
    rendered_course = make('## `<img src=x onerror="alert(1)">`\n\n`</script>` & \u2028 `\x07`.\n')
    library = rendered_course.library()
    note = note_page(inputs_of(library, "lesson", "0.1"), rendered_course.page(), "")
    text = text_and_terms(note)[0].decode()
    sections = json.loads(text)
    assert sections[-1][1] == '<img src=x onerror="alert(1)">'
    assert sections[-1][3] == [["t", "</script> & \x07."]]


@pytest.mark.parametrize(
    ("body", "sections"),
    [
        ("", ()),
        (
            "<main><h1>Title</h1><p>Text</p></main>",
            (Section("", "", 0, (SectionPiece("text", "Text"),)),),
        ),
        (
            "<h2 id=a>A <b>b</b></h2><nav>no</nav><ul><li>one<li>two</ul><pre>code</pre>"
            "<h3>B</h3>tail &lt;i>",
            (
                Section("a", "A b", 2, (SectionPiece("text", "one"), SectionPiece("text", "two"))),
                Section("", "B", 3, (SectionPiece("text", "tail <i>"),)),
            ),
        ),
        ("</p></div><p>x<br>y</b></p>", (Section("", "", 0, (SectionPiece("text", "xy"),)),)),
    ],
)
def test_a_drawn_page_by_its_headings(body: str, sections: tuple[Section, ...]) -> None:
    reader = SectionReader()
    reader.html(body)
    assert reader.end() == sections
