"""The course for Hugo: formulas typeset in the build by `transform.ToMath`, or left to KaTeX.

Callouts are alerts of GitHub's kind by a render hook for blockquotes, formulas go through
Goldmark's passthrough extension to a render hook, Chroma highlights. The layouts are as small as
layouts can be. A version without these hooks cannot build the course.
"""

from __future__ import annotations

import json
from pathlib import Path

from benchmarks.generate.document import Lesson
from benchmarks.generate.flavors.common import quote, write_text
from benchmarks.generate.flavors.markdown import Dialect

CONFIG = """baseURL = "https://example.org/methods/"
title = "Methods and their errors"
languageCode = "en"
disableKinds = ["taxonomy", "term", "rss"]

[markup.highlight]
noClasses = false

[markup.goldmark.extensions.passthrough]
enable = true

[markup.goldmark.extensions.passthrough.delimiters]
block = [["$$", "$$"]]
inline = [["$", "$"]]
"""
HOOK_BUILD = """{{- $opts := dict "output" "htmlAndMathml" "displayMode" (eq .Type "block") -}}
{{- with try (transform.ToMath .Inner $opts) -}}
{{- with .Err -}}{{ errorf "formula: %s" . }}{{- else -}}{{ .Value }}{{- end -}}
{{- end -}}
"""
HOOK_READER = """{{- if eq .Type "block" -}}\\[{{ .Inner }}\\]
{{- else -}}\\({{ .Inner }}\\){{- end -}}
"""
ALERT = """{{- if eq .Type "alert" -}}
{{- if .AlertSign -}}
<details class="callout {{ .AlertType }}"><summary>{{ .AlertTitle }}</summary>{{ .Text }}</details>
{{- else -}}
<div class="callout {{ .AlertType }}"><p class="title">{{ .AlertTitle }}</p>{{ .Text }}</div>
{{- end -}}
{{- else -}}
<blockquote>{{ .Text }}</blockquote>
{{- end -}}
"""
BASE = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width">
<title>{{ .Title }} · {{ site.Title }}</title>
<meta name="description" content="{{ .Description }}">
<link rel="stylesheet" href="/style.css">
</head>
<body>
<nav><a href="/">{{ site.Title }}</a></nav>
<main>{{ block "main" . }}{{ end }}</main>
</body>
</html>
"""
SINGLE = """{{ define "main" }}
<article><h1>{{ .Title }}</h1>
<aside>{{ .TableOfContents }}</aside>
{{ .Content }}</article>
<footer>
{{ with .PrevInSection }}<a rel="prev" href="{{ .RelPermalink }}">{{ .Title }}</a>{{ end }}
{{ with .NextInSection }}<a rel="next" href="{{ .RelPermalink }}">{{ .Title }}</a>{{ end }}
</footer>
{{ end }}
"""
LIST = """{{ define "main" }}
<h1>{{ .Title }}</h1>
<ol>{{ range site.RegularPages }}
<li><a href="{{ .RelPermalink }}">{{ .Title }}</a></li>{{ end }}</ol>
{{ end }}
"""


def callout(kind: str, title: str, folded: bool, body: str) -> str:
    """An alert."""
    return quote(f"[!{kind}]{'-' if folded else ''} {title}\n{body}")


def write(lessons: list[Lesson], folder: Path, hook: str = HOOK_BUILD) -> None:
    """The configuration, the layouts, and a page for each lesson."""
    names = {lesson.id: lesson.name for lesson in lessons}
    dialect = Dialect(callout, lambda id_: f"/lessons/{names[id_].replace('.', '-')}/")
    for lesson in lessons:
        head = (
            f"---\ntitle: {json.dumps(lesson.title)}\nweight: {lesson.number + 1}\n"
            f"description: {json.dumps(lesson.summary)}\n"
            f"slug: {lesson.name.replace('.', '-')}\n---\n"
        )
        text = f"{head}\n{dialect.lesson(lesson)}"
        write_text(folder / "content" / "lessons" / f"{lesson.name}.md", text)
    write_text(folder / "hugo.toml", CONFIG)
    layouts = folder / "layouts"
    write_text(layouts / "_default" / "baseof.html", BASE)
    write_text(layouts / "_default" / "single.html", SINGLE)
    write_text(layouts / "_default" / "list.html", LIST)
    write_text(layouts / "_default" / "_markup" / "render-passthrough.html", hook)
    write_text(layouts / "_default" / "_markup" / "render-blockquote.html", ALERT)
    write_text(folder / "static" / "style.css", "body { max-width: 45rem; margin: auto }\n")
