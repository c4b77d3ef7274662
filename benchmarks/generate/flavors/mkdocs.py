"""The course for MkDocs with Material, and for Zensical, which reads the same files.

Admonitions and formulas as Material's manual has them: pymdownx.arithmatex leaves formulas to
KaTeX in the reader's browser, for there is no usual way to typeset them in the build. Pygments
highlights.
"""

from __future__ import annotations

from pathlib import Path

from benchmarks.generate.document import Lesson
from benchmarks.generate.flavors.common import indent, write_text
from benchmarks.generate.flavors.markdown import Dialect

CONFIG = """site_name: Methods and their errors
site_url: https://example.org/methods/
theme:
  name: material
  font: false
  features:
    - navigation.sections
    - navigation.footer
markdown_extensions:
  - admonition
  - attr_list
  - footnotes
  - tables
  - toc:
      permalink: true
  - pymdownx.details
  - pymdownx.superfences
  - pymdownx.highlight
  - pymdownx.arithmatex:
      generic: true
extra_javascript:
  - https://cdn.jsdelivr.net/npm/katex@0.16/dist/katex.min.js
  - https://cdn.jsdelivr.net/npm/katex@0.16/dist/contrib/auto-render.min.js
extra_css:
  - https://cdn.jsdelivr.net/npm/katex@0.16/dist/katex.min.css
plugins:
  - search
nav:
  - index.md
"""
KINDS = {"established": "success", "derivation": "abstract", "implementation": "example"}


def callout(kind: str, title: str, folded: bool, body: str) -> str:
    """An admonition of Python-Markdown, or the folding one of pymdownx."""
    return f'{"???" if folded else "!!!"} {KINDS.get(kind, kind)} "{title}"\n{indent(body)}'


def write(lessons: list[Lesson], folder: Path) -> None:
    """The configuration with the navigation, and a page for each lesson."""
    names = {lesson.id: lesson.name for lesson in lessons}
    dialect = Dialect(callout, lambda id_: f"{names[id_]}.md")
    nav, level = [CONFIG], ""
    for lesson in lessons:
        head = lesson.id.split(".")[0]
        if head != level:
            level = head
            nav.append(f"  - Problems, part {level}:\n")
        nav.append(f'    - "{lesson.id} {lesson.title}": lessons/{lesson.name}.md\n')
        text = f"# {lesson.title}\n\n{dialect.lesson(lesson)}"
        write_text(folder / "docs" / "lessons" / f"{lesson.name}.md", text)
    links = "".join(f"- [{x.title}](lessons/{x.name}.md)\n" for x in lessons)
    write_text(folder / "docs" / "index.md", f"# Methods and their errors\n\n{links}")
    write_text(folder / "mkdocs.yml", "".join(nav))
