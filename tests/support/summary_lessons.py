"""Lessons with all that others look at, and what pages of them are made from."""

from __future__ import annotations

import functools

from msgspec.structs import replace

from coursebuild.core.features import PublishedTrials
from coursebuild.core.model import Course, Document
from coursebuild.core.model.results import Results
from coursebuild.core.model.vocabulary import CALLOUTS
from coursebuild.core.pages.assets import Assets
from coursebuild.core.pages.library import Library
from coursebuild.core.syntax.document import parse_document
from coursebuild.core.text.source import Source
from support.scratch_course import ROOT, block

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


def document(path: str, text: str) -> Document:
    return parse_document(Source(path, text), KINDS, lesson=True).value


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


def library_of(course: Course, results: Results) -> Library:
    """What pages of a course of skeletons are made from."""
    return Library.of(course, results, assets(), trials=PublishedTrials())
