"""The course for Sphinx with MyST-Parser.

Formulas with `dollarmath`: Sphinx's default leaves them to MathJax in the reader's browser.
Directives with colon fences for callouts; Pygments highlights; the default theme.
"""

from __future__ import annotations

from pathlib import Path

from benchmarks.generate.document import Lesson
from benchmarks.generate.flavors.common import write_text
from benchmarks.generate.flavors.markdown import Dialect

CONFIG = """project = "Methods and their errors"
extensions = ["myst_parser", "sphinx.ext.mathjax"]
myst_enable_extensions = ["colon_fence", "dollarmath", "attrs_block"]
myst_heading_anchors = 3
html_theme = "alabaster"
"""
KINDS = {"established": "note", "derivation": "note", "implementation": "note"}


def callout(kind: str, title: str, folded: bool, body: str) -> str:
    """An admonition; what is folded elsewhere has the class `dropdown`, which themes fold."""
    names = f"{KINDS.get(kind, kind)}{' dropdown' if folded else ''}"
    return f":::{{admonition}} {title}\n:class: {names}\n\n{body}\n:::"


def write(lessons: list[Lesson], folder: Path) -> None:
    """The configuration, the tree of contents, and a page for each lesson."""
    names = {lesson.id: lesson.name for lesson in lessons}
    dialect = Dialect(callout, lambda id_: f"{names[id_]}.md")
    for lesson in lessons:
        text = f"# {lesson.title}\n\n{dialect.lesson(lesson)}"
        write_text(folder / "lessons" / f"{lesson.name}.md", text)
    entries = "".join(f"lessons/{lesson.name}\n" for lesson in lessons)
    tree = f"```{{toctree}}\n:maxdepth: 1\n\n{entries}```\n"
    write_text(folder / "index.md", f"# Methods and their errors\n\n{tree}")
    write_text(folder / "conf.py", CONFIG)
