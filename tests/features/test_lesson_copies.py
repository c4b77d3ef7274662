"""Lessons as Markdown, and as notebooks."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import nbformat
import pytest

from coursebuild.core.model.results import Outcome, ScriptRun
from coursebuild.core.pages.urls import Place
from coursebuild.features.markdown.copies import markdown_href
from support.fixture_cases import check_text
from support.rendered_course import Make

LESSON = """## Part {#part}

See Lesson 1.1, [there](lesson:1.1#more), [the box](model:box), [the page](page:about) and
[here](#part). It is `1.5`{out=examples/a.py}.[^n]

```io
INPUT: a *number*
PROCESS: none
OUTPUT: `two`
```

```python file=examples/a.py args="--n 'a b'"
print("one")
print("```")
```

Output:

```text
one
two
```

> [!derivation]- By hand
> $$x = 1$$
>
> ```python file=examples/in_callout.py
> print("one")
> ```
>
> Output:
>
> ```text
> one
> two
> ```

```mjcf fragment="worldbody" error="bad"
<body/>
```

```quiz
{"id": "q", "title": "Check", "questions": [
 {"kind": "mcq", "q": "Which?", "options": ["$a$", "b"], "answer": 1, "hints": ["Think."],
  "feedback": ["no", "yes"], "explain": "So."},
 {"kind": "numeric", "q": "How many?", "answer": 2, "tol": 0.1, "unit": "kg m^2"},
 {"kind": "open", "q": "Why?", "reference": "Hence."},
 {"kind": "output", "q": "What?", "of": "examples/a.py", "line": 2},
 {"kind": "order", "q": "Sort.", "items": ["a", "b"]}]}
```

### Never

```python file=examples/never.py norun requires=torch,mjx
raise SystemExit
```

[^n]: A note with $y$.
"""
NEXT_LESSON = """## More {#more}

Back to [it](lesson:0.1#part).

```lab simlab
{"model": "box"}
```

```lab mjcf
<mujoco/>
```
"""


def site(make: Make, text: str = LESSON, **texts: str) -> dict[str, bytes]:
    runs = {"examples/never.py": ScriptRun("examples/never.py", Outcome.NORUN, 0, "", "", 0.0)}
    texts.setdefault("1.1", NEXT_LESSON)
    files: dict[str, bytes] = make(text, runs=runs, **texts).site()
    return files


@pytest.fixture(scope="module")
def files(make: Make) -> dict[str, bytes]:
    return site(make)


def cells(data: bytes) -> list[dict[str, Any]]:
    nbformat.validate(nbformat.reads(data.decode(), as_version=4))
    notebook_cells: list[dict[str, Any]] = json.loads(data)["cells"]
    return notebook_cells


def source(cell: dict[str, Any]) -> str:
    return "".join(cell["source"])


# ------------------------------------------------------------------------------------ Markdown


def test_a_lesson_as_markdown(files: dict[str, bytes], rewriting: bool) -> None:
    text = files["lessons/0.1-falling.md"].decode()
    check_text(Path(__file__).with_name("lesson_copy.md"), text, rewriting=rewriting)


def test_every_page_names_its_markdown(files: dict[str, bytes]) -> None:
    for path, data in files.items():
        if path.endswith(".html"):
            addresses = re.findall(
                r'<link rel="alternate" type="text/markdown" href="([^"]*)">', data.decode()
            )
            folder = path.rpartition("/")[0]
            copy = f"{folder}/{addresses[0]}".lstrip("/") if addresses else ""
            assert bool(addresses) is (path.removesuffix(".html") + ".md" in files), path
            assert not addresses or copy in files


def test_pages_without_a_document_as_markdown(files: dict[str, bytes]) -> None:
    home = files["index.md"].decode()
    assert home.startswith('# Bodies & \\<axes>\n\nA "short" course.\n')
    assert "(lessons/0.1-falling.md)" in home and "(levels/1.md)" in home
    model = files["models/box.md"].decode()
    assert "- Bodies: 1\n" in model and '```xml\n<mujoco model="box">' in model
    assert "not written yet" in files["lessons/1.2-later.md"].decode()


# ----------------------------------------------------------------------------------- notebooks


def test_a_lesson_as_a_notebook(files: dict[str, bytes]) -> None:
    notebook_cells = cells(files["lessons/0.1-falling.ipynb"])
    scripts = {cell["id"]: cell for cell in notebook_cells if cell["cell_type"] == "code"}
    assert list(scripts) == ["setup", "code-a-1", "code-in-callout-1", "code-never-1"]
    assert 'FILES = ""\n' in source(scripts["setup"]), "each script stands in its own cell alone"
    first = scripts["code-a-1"]
    assert source(first) == ('%%example examples/a.py --n \'a b\'\nprint("one")\nprint("```")')
    assert first["outputs"] == [
        {"name": "stdout", "output_type": "stream", "text": ["one\n", "two\n"]}
    ]
    assert scripts["code-never-1"]["outputs"] == []
    assert source(scripts["code-never-1"]).startswith(
        "%%example --requires=torch,mjx --norun examples/never.py\n"
    )
    texts = "\n".join(source(cell) for cell in notebook_cells if cell["cell_type"] == "markdown")
    for piece in (
        "[Lesson 1.1](https://example.org/course/lessons/1.1-spinning.html)",
        "[here](https://example.org/course/lessons/0.1-falling.html#part)",
        "It is 1.5.<sup>1</sup>",
        "(https://example.org/course/examples/in_callout.py) is in a cell below.",
        "<details>\n   <summary>Answer</summary>\n\n   B.",
        "## Footnotes\n\n1. A note with $y$.",
    ):
        assert piece in texts, piece


def test_a_lesson_without_scripts_needs_no_setup(files: dict[str, bytes]) -> None:
    notebook_cells = cells(files["lessons/1.1-spinning.ipynb"])
    assert {cell["cell_type"] for cell in notebook_cells} == {"markdown"}


def test_a_model_that_readers_edit_is_shown_as_code(files: dict[str, bytes]) -> None:
    lesson = "lessons/1.1-spinning"
    (text,) = (source(cell) for cell in cells(files[f"{lesson}.ipynb"]) if "mujoco" in source(cell))
    for copy in (files[f"{lesson}.md"].decode(), text):
        assert "A simulation of a model of its own.\n\n```xml\n<mujoco/>\n```\n" in copy
    page = files[f"{lesson}.html"].decode()
    still = page[page.index('data-kind="mjcf"') :].partition("</section>")[0]
    assert '<code class="language-xml">' in still


def test_an_edit_keeps_the_ids_of_other_cells(make: Make, files: dict[str, bytes]) -> None:
    new_text = LESSON.replace("### Never", "## New\n\nText.\n\n### Never").replace(
        "a *number*", "b"
    )
    before = [cell["id"] for cell in cells(files["lessons/0.1-falling.ipynb"])]
    after = [cell["id"] for cell in cells(site(make, new_text)["lessons/0.1-falling.ipynb"])]
    assert [id for id in after if id != "text-new-1"] == before


def test_ids_of_cells_differ_whatever_the_headings(make: Make) -> None:
    text = "## 重力\n\na\n\n## " + "x" * 200 + "\n\nb\n\n## 重力\n\nc\n\n## !\n\nd\n"
    ids = [cell["id"] for cell in cells(site(make, text)["lessons/0.1-falling.ipynb"])]
    assert len(set(ids)) == len(ids) == 5


def test_numbers_are_written(make: Make) -> None:
    text = (
        "## Part {#part}\n\n$$\na = b % so\n$$ {#eq:one}\n\nBy $$c$$ {#eq:two} and [](#eq:two), "
        "from [](#eq:one) and [](#tab:x).\n\nTable: *Some*. {#tab:x}\n\n| a |\n| --- |\n| b |\n\n"
        "```python fragment {#lst:x}\nx = 1\n```\n"
    )
    copy = site(make, text)["lessons/0.1-falling.md"].decode()
    assert "[Table 0.1.1](#tab:x)" in copy
    assert "**Table 0.1.1:** *Some*.\n\n| a |" in copy
    assert "**Listing 0.1.1:**\n\n```python" in copy
    assert "$$\na = b % so\n\\tag{1}\n$$" in copy
    assert "[(1)](#eq:one)" in copy


def test_addresses_lead_to_the_markdown_of_their_page() -> None:
    place = Place("lessons/1.1-a.html")
    cases = [
        ("1.2-b.html", "1.2-b.md"),
        ("../levels/0.html#a%20b", "../levels/0.md#a%20b"),
        ("%C3%A9.html?q=1", "%C3%A9.md?q=1"),
        ("../files/a.html", "../files/a.html"),
        ("../../out.html", "../../out.html"),
        ("../search/index.html", "../search/index.html"),
        ("a.htm", "a.htm"),
        ("#a", "#a"),
        ("https://e.org/a.html", "https://e.org/a.html"),
        ("//[.html", "//[.html"),
    ]
    assert [markdown_href(place, href) for href, _ in cases] == [copy for _, copy in cases]
