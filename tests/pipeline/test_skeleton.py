"""A document without its prose tells the rest of the course what the whole document tells it."""

from __future__ import annotations

import functools
from dataclasses import replace
from pathlib import Path

import pytest
from coursekit import ROOT, block
from hypothesis import given, settings
from hypothesis import strategies as st

from coursebuild.checks.compiled import mjcf_texts
from coursebuild.checks.course import check_course
from coursebuild.checks.quizzes import check_output_lines
from coursebuild.model import Course, Document, document_blocks
from coursebuild.model.skeleton import skeleton
from coursebuild.pipeline.outlines import Outline, packed, unpacked
from coursebuild.render.assets import Assets
from coursebuild.render.lab_files import PublishedLabs
from coursebuild.render.library import (
    Library,
    document_scripts,
    lexicon_of,
    named_models,
    place,
)
from coursebuild.render.lookup.lexicon import lexicon
from coursebuild.render.lookup.references import mentions
from coursebuild.render.sheet import fingerprint
from coursebuild.render.shown import shown
from coursebuild.render.urls import Place
from coursebuild.results import Outcome, Results, ScriptRun
from coursebuild.scripts.compare import verify
from coursebuild.scripts.extract import extract
from coursebuild.scripts.findings import script_findings
from coursebuild.source import Source
from coursebuild.syntax.coursemap import parse_course_map
from coursebuild.syntax.document import parse_document
from coursebuild.vocabulary import CALLOUTS

KINDS = frozenset(kind.name for kind in CALLOUTS)
MAP = """
[course]
title = "Two"

[[page]]
id = "about"
title = "About"
file = "content/pages/about.md"

[[level]]
id = "1"
title = "One"

[[level.lesson]]
id = "1.1"
slug = "first"
title = "First"
status = "complete"

[[level.lesson]]
id = "1.2"
slug = "second"
title = "Second"
status = "complete"
"""
PARTS = [
    "## Heading {#here}\n\n",
    "# Top [a](lesson:1.2#there) $x$\n\n",
    "Prose with *[a link](lesson:1.2#here)*, ![p](p.png), <b id=b>html</b>, `12.5`{out} more.\n\n",
    "The [thing]{term} is *a [b](lesson:1.1)*; see [it](term:thing), [no](term:nothing).\n\n",
    "$$a$$ {#eq:a}\n\nBy [](#eq:a) and [](lesson:1.2#eq:a), $$b$$ [x](lesson:1.1#eq:gone).\n\n",
    "## A [title]{term}\n\n> The [thing]{term=other} is\n>\n> $$c$$\n\n",
    "See lesson 1.2 and Level 1, [x](page:about#here) and [y](examples/a.py), [z](model:box).\n\n",
    "[^n] and [^n] again\n\n[^n]: A note: [l](#nowhere), $y$, `1.5`{out=examples/a.py}\n\n",
    '<div id="raw">\n<a href="#gone">x</a>\n</div>\n\n',
    "> [!note]- A *title* [t](lesson:9.9)\n> Inside <i>x</i>\n>\n> ## In it\n\n",
    "> quoted `2`{out}\n>\n> - item [i](level:1)\n>   - deeper ![q](no.png)\n\n",
    "| a | `3`{out} |\n| - | - |\n| [b](lesson:1.1) | $c$ |\n\n",
    block("a.py", 'print("one", 1.5)\nprint(12.5)\n', "one 1.5\n12.5"),
    block("a.py", "print(2)\n", "2"),
    block("b.py", 'print("x 1")\nprint("y 2")\n')
    + "Output:\n\n| n | v |\n| - | - |\n| x | 1 |\n| [y](lesson:1.2) | $2$ |\n\n",
    "```mjcf\n<mujoco/>\n```\n\n",
    "```bench box\n```\n\n",
    "```bench arm scenario=swing show=table\n```\n\n",
    '```mjcf fragment="worldbody" error="no"\n<body/>\n```\n\n',
    '```lab simlab\n{"model": "box", "note": "A [n](lesson:1.2) `4`{out}", "key": 1}\n```\n\n',
    '```lab other\n{"model": "gone"}\n```\n\n',
    '```quiz\n{"id": "q", "title": "Q", "questions": [{"kind": "output", "q": "[w](#here) $z$",'
    ' "script": "examples/a.py", "line": 7, "explain": "## E"},'
    ' {"kind": "mcq", "q": "W?", "options": ["[o](lesson:1.1)", "b"], "answer": 0,'
    ' "feedback": ["![f](f.png)", ""]}]}\n```\n\n',
    "```io\ninput: [i](lesson:3.3)\nprocess: `5`{out}\noutput: o\n```\n\n",
    "    indented\n\n",
    "$$\n\\frac{a}{b}\n$$\n\n",
    "***\n\n",
]
FIXTURES = sorted((ROOT / "tests" / "fixtures").rglob("*.md")) + sorted(
    (ROOT / "tests" / "courses").rglob("*.md")
)


def courses(*texts: str) -> tuple[Course, Course]:
    """A course of these lessons and the last as a page: whole, and of skeletons."""
    parsed = parse_course_map(Source("content/course.toml", MAP))
    assert parsed.value is not None
    whole = [document(f"content/{i}.md", text) for i, text in enumerate(texts)]
    return with_documents(parsed.value, whole), with_documents(parsed.value, map(again, whole))


def document(path: str, text: str) -> Document:
    return parse_document(Source(path, text), KINDS, lesson=True).value


def again(document: Document) -> Document:
    """The skeleton as it comes from the store."""
    bare = replace(skeleton(document), lexicon=lexicon(document, {}))
    found = unpacked(packed(Outline(bare, (), {}, True)), document.source)
    assert found is not None
    return found.skeleton


def with_documents(course: Course, documents: object) -> Course:
    given = list(documents)  # type: ignore[call-overload]
    lessons = tuple(
        replace(lesson, document=one)
        for lesson, one in zip(course.lessons, [*given, None, None], strict=False)
    )
    return replace(course, levels=(replace(course.levels[0], lessons=lessons),))


@functools.cache
def assets() -> Assets:
    texts = (ROOT / "templates" / "strings" / "en.toml").read_text(encoding="utf-8")
    return Assets((("strings/en.toml", texts),), ())


def told(course: Course) -> list[object]:
    """Everything that is known of a course by its documents."""
    extracted = extract(course)
    runs = [
        ScriptRun(e.path, Outcome.OK if i % 3 else Outcome.FAILED, 0, "one 1.5\nx 1\n", "", 0.0)
        for i, e in enumerate(extracted.value, 1)
    ]
    verdicts = verify(course, runs)
    library = Library.made(
        course,
        Results(tuple(runs), verdicts, (), (), "3", "3"),
        assets(),
        scripts_of=document_scripts,
        models_of=named_models,
        mentions_of=lambda document: mentions(document, course, lexicon_of(document, {})),
        labs=PublishedLabs({}, ()),
        formulas={},
        verdicts={place(verdict.recording): verdict for verdict in verdicts},
    )
    here = Place("lessons/x.html")
    return [
        check_course(course),
        [(text.text, text.code, text.block.span, text.lines_before) for text in mjcf_texts(course)],
        extracted.diagnostics,
        [(e.path, e.text, e.owner, e.script) for e in extracted.value],
        [(v.recording.span, v.recording.body, v.status, v.changes, v.diff) for v in verdicts],
        script_findings(course, extracted.value, runs, verdicts),
        check_output_lines(course, runs),
        [(n, [(u.owner.id, u.by_lab, u.by_script) for u in us]) for n, us in library.uses.items()],
        said(library),
        [shown_or_not(library, here, document) for document in course.documents],
    ]


def said(library: Library) -> list[object]:
    """What documents say of each other."""
    found = library.references
    return [
        {id: [owner.id for owner in owners] for id, owners in found.referrers.items()},
        [(t.term, t.owner.id, [owner.id for owner in t.used]) for t in found.terms.values()],
    ]


def shown_or_not(library: Library, here: Place, document: Document) -> object:
    try:
        return fingerprint(shown(library, here, document))
    except KeyError as error:  # a link that leads nowhere, in a course that is never drawn
        return repr(error)


@given(st.lists(st.lists(st.sampled_from(PARTS), max_size=6), min_size=1, max_size=2))
@settings(max_examples=60)
def test_a_skeleton_tells_what_the_document_tells(lessons: list[list[str]]) -> None:
    whole, bare = courses(*("".join(parts) for parts in lessons))
    assert told(whole) == told(bare)


@pytest.mark.parametrize("path", FIXTURES, ids=lambda path: path.name)
def test_those_of_the_fixtures_too(path: Path) -> None:
    whole, bare = courses(path.read_text(encoding="utf-8"), "".join(PARTS))
    assert told(whole) == told(bare)


def test_prose_is_not_in_a_skeleton() -> None:
    whole = document("content/a.md", "Only *prose*, `code` and $x$ here.\n\n- and\n- there\n")
    assert list(document_blocks(skeleton(whole))) == []
