"""The course for Eleventy: formulas by KaTeX in the build, Prism highlights.

markdown-it renders, with plugins for formulas and for alerts of GitHub's kind; one small layout.
The packages are those of `benchmarks/package.json`, found through a link beside the course.
"""

from __future__ import annotations

import json
from pathlib import Path

from benchmarks.generate.document import Lesson
from benchmarks.generate.flavors.common import quote, write_text
from benchmarks.generate.flavors.markdown import Dialect

CONFIG = """import { alert } from "@mdit/plugin-alert";
import { katex } from "@mdit/plugin-katex";
import highlight from "@11ty/eleventy-plugin-syntaxhighlight";

export default function (config) {
  config.addPlugin(highlight);
  config.amendLibrary("md", (md) => md.use(katex).use(alert));
  config.addCollection("lessons", (api) =>
    api.getFilteredByTag("lesson").sort((a, b) => a.data.order - b.data.order));
  return {
    dir: { input: "content", output: "_site", includes: "../layouts" },
    markdownTemplateEngine: false,
  };
}
"""
LAYOUT = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width">
<title>{{ title }}</title>
<meta name="description" content="{{ description }}">
<link rel="stylesheet" href="https://cdn.jsdelivr.net/npm/katex@0.16/dist/katex.min.css">
</head>
<body>
<nav><a href="/">Methods and their errors</a></nav>
<main><article><h1>{{ title }}</h1>
{{ content | safe }}</article></main>
<footer>
{% if before %}<a rel="prev" href="/lessons/{{ before }}/">{{ before }}</a>{% endif %}
{% if after %}<a rel="next" href="/lessons/{{ after }}/">{{ after }}</a>{% endif %}
</footer>
</body>
</html>
"""
INDEX = """---
title: Methods and their errors
permalink: /
---
<ol>
{% for page in collections.lessons %}<li><a href="{{ page.url }}">{{ page.data.title }}</a></li>
{% endfor %}</ol>
"""


def callout(kind: str, title: str, folded: bool, body: str) -> str:
    """An alert of one of the five kinds that there are; what is folded goes into `details`."""
    if folded:
        return f"<details><summary>{title}</summary>\n\n{body}\n\n</details>"
    alert = {"warning": "warning", "tip": "tip"}.get(kind, "note")
    return quote(f"[!{alert}]\n**{title}**\n\n{body}")


def write(lessons: list[Lesson], folder: Path) -> None:
    """The configuration, the layout, and a page for each lesson."""
    names = {lesson.id: lesson.name.replace(".", "-") for lesson in lessons}
    dialect = Dialect(callout, lambda id_: f"/lessons/{names[id_]}/")
    ids = ["", *(lesson.id for lesson in lessons), ""]
    for i, lesson in enumerate(lessons):
        head = {
            "title": lesson.title,
            "description": lesson.summary,
            "order": lesson.number,
            "tags": "lesson",
            "layout": "lesson.njk",
            "permalink": f"/lessons/{names[lesson.id]}/",
            "before": names.get(ids[i], ""),
            "after": names.get(ids[i + 2], ""),
        }
        rows = "".join(f"{key}: {json.dumps(value)}\n" for key, value in head.items())
        text = f"---\n{rows}---\n\n{dialect.lesson(lesson)}"
        write_text(folder / "content" / "lessons" / f"{names[lesson.id]}.md", text)
    write_text(folder / "content" / "index.njk", INDEX)
    write_text(folder / "layouts" / "lesson.njk", LAYOUT)
    write_text(folder / "eleventy.config.js", CONFIG)
    write_text(folder / "package.json", '{"private": true, "type": "module"}\n')
