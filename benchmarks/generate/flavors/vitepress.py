"""The course for VitePress: MathJax and Shiki in the build, containers for callouts.

Measured for its preview, which renders one page at a time when it is asked for.
"""

from __future__ import annotations

import json
from pathlib import Path

from benchmarks.generate.document import Lesson
from benchmarks.generate.flavors.common import write_text
from benchmarks.generate.flavors.markdown import Dialect

KINDS = {"warning": "warning", "tip": "tip"}


def callout(kind: str, title: str, folded: bool, body: str) -> str:
    """A container."""
    name = "details" if folded else KINDS.get(kind, "info")
    return f"::: {name} {title}\n{body}\n:::"


def write(lessons: list[Lesson], folder: Path) -> None:
    """The configuration with the side bar, and a page for each lesson."""
    names = {lesson.id: lesson.name.replace(".", "-") for lesson in lessons}
    dialect = Dialect(callout, lambda id_: f"/lessons/{names[id_]}")
    groups: dict[str, list[dict[str, str]]] = {}
    for lesson in lessons:
        item = {"text": lesson.title, "link": f"/lessons/{names[lesson.id]}"}
        groups.setdefault(lesson.id.split(".")[0], []).append(item)
        head = f"---\ntitle: {json.dumps(lesson.title)}\n---\n\n# {lesson.title}\n\n"
        write_text(folder / "lessons" / f"{names[lesson.id]}.md", head + dialect.lesson(lesson))
    sidebar = [
        {"text": f"Problems, part {level}", "items": items} for level, items in groups.items()
    ]
    config = {
        "title": "Methods and their errors",
        "markdown": {"math": True},
        "themeConfig": {"sidebar": sidebar},
    }
    text = f"export default {json.dumps(config, indent=1, ensure_ascii=False)}\n"
    write_text(folder / ".vitepress" / "config.mjs", text)
    write_text(folder / "index.md", "# Methods and their errors\n")
    write_text(folder / "package.json", '{"private": true, "type": "module"}\n')
