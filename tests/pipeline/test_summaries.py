"""Summaries of documents serve the rest of the course as well as the whole documents."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from coursebuild.core.checks.compiled import mjcf_texts
from coursebuild.core.engine.store import Store
from coursebuild.core.model import Course
from coursebuild.core.model.results import Outcome, ScriptRun
from coursebuild.core.registry import check_runs, feature_trials
from coursebuild.core.scripts.compare import verify
from coursebuild.core.scripts.extract import extract
from coursebuild.core.scripts.findings import script_findings
from coursebuild.core.text.diagnostics import Parsed
from coursebuild.pipeline.load import load
from coursebuild.pipeline.options import Options
from coursebuild.pipeline.reader import Reader
from support.scratch_course import GOOD, ROOT, Folder, block

pytestmark = pytest.mark.site

FIXTURES = [
    path for top in ("fixtures", "courses") for path in sorted((ROOT / "tests" / top).rglob("*.md"))
]
ENTRY = '[[level.lesson]]\nid = "1.{0}"\nslug = "l"\ntitle = "L"\nstatus = "complete"\n'


def parts_of(parsed_course: Parsed[Course | None]) -> Iterator[object]:
    """The diagnostics of a course, then what its documents hold for the others."""
    course = parsed_course.value
    assert course is not None
    extracted = extract(course)
    runs = [
        ScriptRun(e.path, Outcome.OK if i % 3 else Outcome.FAILED, 0, "one 1.5\nx 1\n", "", 0.0)
        for i, e in enumerate(extracted.value, 1)
    ]
    verdicts = verify(course, runs)
    yield {(d.rule, d.span.path, d.span.start, d.message) for d in parsed_course.diagnostics}
    yield [(t.text, t.code, t.block.span, t.lines_before) for t in mjcf_texts(course)]
    yield extracted.diagnostics
    yield [(e.path, e.text, e.owner, e.script) for e in extracted.value]
    yield [(v.recording.span, v.recording.body, v.status, v.changes) for v in verdicts]
    yield script_findings(course, extracted.value, runs, verdicts)
    yield list(check_runs(course, runs))
    yield [
        (name, trial.owner, trial.block.span) for name, (_, trial) in feature_trials(course).items()
    ]


def test_course_of_summaries_tells_what_the_whole_course_tells(tmp_path: Path) -> None:
    """For lessons that were just read, and from the store."""
    entries = "".join(ENTRY.format(n) for n in range(len(FIXTURES)))
    folder = Folder(tmp_path)
    folder.write(
        "content/course.toml",
        f'[course]\ntitle = "C"\n\n[[level]]\nid = "1"\ntitle = "L"\n\n{entries}',
    )
    for n, path in enumerate(FIXTURES):
        folder.write(f"content/lessons/1.{n}-l.md", path.read_bytes())
    (diagnostics, *whole) = parts_of(load(tmp_path))
    for _ in range(2):
        with Reader(Options(tmp_path, 1, Store(tmp_path))) as reader:
            (diagnostics_of_summaries, *parts_of_summaries) = parts_of(load(tmp_path, reader))
        assert isinstance(diagnostics_of_summaries, set) and isinstance(diagnostics, set)
        assert len(diagnostics) > 1000
        assert diagnostics_of_summaries > diagnostics, "formulas are looked at as well"
        assert parts_of_summaries == whole


TEXT = "".join(
    [
        "## Heading {#here}\n\n",
        "# Top [a](lesson:1.2#there) $x$\n\n",
        "Prose: *[a link](lesson:1.2#here)*, ![p](p.png), <b id=b>html</b>, `12.5`{out} more.\n\n",
        "The [thing]{term} is *a [b](lesson:1.1)*; see [it](term:thing), [no](term:nothing).\n\n",
        "$$a$$ {#eq:a}\n\nBy [](#eq:a) and [](lesson:1.2#eq:a), $$b$$ [x](lesson:1.1#eq:gone).\n\n",
        "## A [title]{term}\n\n> The [thing]{term=other} is\n>\n> $$c$$\n\n",
        "See lesson 1.2, [x](page:about#here) and [y](examples/a.py), [z](model:box).\n\n",
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
)
VISIBLE_CHANGES = [
    ("{#here}", "{#there}"),
    ("lesson:1.2#here", "lesson:1.1#here"),
    ("<b id=b>", "<b id=c>"),
    ('href="#gone"', 'href="#raw"'),
    ("[thing]{term}", "[thing]{term=sing}"),
    ("{#eq:a}", "{#eq:b}"),
    ("print(2)", "print(3)"),
    ("| x | 1 |", "| x | 2 |"),
    ("<mujoco/>", "<mujoco />"),
    ('"id": "q"', '"id": "r"'),
    ('"model": "box"', '"model": "ball"'),
    ("bench box", "bench arm"),
    ("[!note]", "[!warning]"),
    ("![p](p.png)", "![p](q.png)"),
]


def test_fingerprint_changes_with_what_others_see_and_not_with_prose(
    tmp_path: Path, stores: Path
) -> None:
    folder = Folder(tmp_path / "course")
    folder.fill([TEXT, GOOD], stores)

    def of(text: str) -> str | None:
        folder.write(folder.lesson(), text)
        with Reader(folder.options()) as reader:
            course = load(folder.root, reader).value
            assert isinstance(course, Course)
            return reader.fingerprints(course)[1]

    plain = of(TEXT)
    assert of("Plain words.\n\n" + TEXT) == plain == of(TEXT + "Plain words.\n")
    assert all(old in TEXT for old, _ in VISIBLE_CHANGES)
    assert [new for old, new in VISIBLE_CHANGES if of(TEXT.replace(old, new, 1)) == plain] == []
