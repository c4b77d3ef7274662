"""The course for coursebuild: lessons, and their map."""

from __future__ import annotations

import json
from pathlib import Path

from benchmarks.generate.document import Callout, InOut, Lesson, Piece, Quiz, Script
from benchmarks.generate.flavors.common import quote, write_text

HEAD = """[course]
title = "Methods and their errors"
summary = "Known solutions, four methods, and what each of them gets wrong."
language = "en"
base_url = "https://example.org/methods/"

[verify]
compare = "digits"
"""


def write(lessons: list[Lesson], folder: Path) -> None:
    """The map and a file for each lesson."""
    parts = [HEAD]
    level = ""
    for lesson in lessons:
        head = lesson.id.split(".")[0]
        if head != level:
            level = head
            parts.append(f'[[level]]\nid = "{level}"\ntitle = "Problems, part {level}"\n')
        needs = ", ".join(f'"{id_}"' for id_ in lesson.prerequisites)
        parts.append(
            f'[[level.lesson]]\nid = "{lesson.id}"\nslug = "{lesson.slug}"\n'
            f'title = "{lesson.title}"\nstatus = "complete"\nsummary = "{lesson.summary}"\n'
            f"prerequisites = [{needs}]\nminutes = 40\n"
        )
        text = "\n\n".join(piece_text(piece, lesson) for piece in lesson.pieces) + "\n"
        write_text(folder / "content" / "lessons" / f"{lesson.name}.md", text)
    write_text(folder / "content" / "course.toml", "\n".join(parts))


def piece_text(piece: Piece, lesson: Lesson) -> str:
    """One piece in the format of lessons."""
    match piece:
        case str():
            return piece
        case Callout(kind, title, folded, text):
            return quote(f"[!{kind}]{'-' if folded else ''} {title}\n{text}")
        case Script(path, code, output):
            return f"```python file={path}\n{code}```\n\nOutput:\n\n```text digits\n{output}```"
        case InOut(takes, does, gives):
            return f"```io\nINPUT: {takes}\nPROCESS: {does}\nOUTPUT: {gives}\n```"
        case Quiz(questions):
            data = {
                "id": f"{lesson.id}-check",
                "title": "Knowledge check",
                "questions": [question.data for question in questions],
            }
            return f"```quiz\n{json.dumps(data, indent=2, ensure_ascii=False)}\n```"
