"""Documents as plain HTML, and what must stay the same when a text is formatted."""

from __future__ import annotations

import html
import json
import re
from collections.abc import Iterable
from pathlib import Path
from typing import Literal

from markupsafe import Markup

from coursebuild.core import model
from coursebuild.core.pages.markup import HtmlWriter, SpecialBlock
from coursebuild.core.pages.renderer import Strings, parse_strings
from coursebuild.core.syntax.document import parse_document
from coursebuild.core.text.diagnostics import Parsed
from coursebuild.core.text.source import Source
from coursebuild.features.authoring.format import format_document
from coursebuild.features.lab.model import Lab
from coursebuild.features.quiz.model import Quiz
from support.random_lessons import KINDS

ENGLISH = Path(__file__).parents[2] / "templates/strings/en.toml"
WORDS = parse_strings(ENGLISH.read_text("utf-8"))
SCHEMES = {
    model.LessonTarget: "lesson",
    model.LevelTarget: "level",
    model.ModelTarget: "model",
    model.PageTarget: "page",
    model.TermTarget: "term",
}
MARKUP_RULES = (
    (r' <a class="anchor" href="#[^"]*" aria-label="[^"]*">#</a>', ""),
    (r'<(h[1-6]|dfn) id="[^"]*"(?: class="[^"]*")?>', r"<\1>"),
    (r'<div class="table"[^>]*>\n(<table>.*?</table>\n)</div>\n', r"\1"),
    (r' class="url">', ">"),
)


def plain_html(document: model.Document) -> str:
    footnotes = PlainWriter().render_footnotes(document.footnotes)
    return plain_blocks(document.blocks) + str(footnotes)


def plain_blocks(blocks: Iterable[model.Block]) -> str:
    text = str(PlainWriter().render_blocks(blocks))
    for pattern, plain in MARKUP_RULES:
        text = re.sub(pattern, plain, text, flags=re.DOTALL)
    return text


def escape(text: str) -> str:
    return html.escape(text, quote=False).replace('"', "&quot;")


class PlainWriter(HtmlWriter):
    """Shows what blocks of ours hold, and addresses as an author writes them."""

    words: Strings = WORDS
    direction: Literal["", "ltr", "rtl"] = ""

    def href(self, target: model.Target) -> str:
        if isinstance(target, model.UrlTarget):
            return target.url
        if isinstance(target, model.ExampleTarget):
            return target.path
        name = target.name if isinstance(target, model.ModelTarget) else target.id
        anchor = getattr(target, "anchor", None)
        return f"{SCHEMES[type(target)]}:{name}" + (f"#{anchor}" if anchor else "")

    def figure(self, block: model.Paragraph, image: model.Image, caption: Markup) -> Markup:
        return Markup(f"<p>{self.inlines((image,))}\n{caption}</p>\n")

    def code(self, language: str, text: str) -> Markup:
        name = f' class="language-{escape(language)}"' if language else ""
        return Markup(f"<pre><code{name}>{escape(text)}</code></pre>\n")

    def binding(self, binding: model.NumberBinding) -> Markup:
        return Markup(f"<code>{escape(binding.text)}</code>")

    def block(self, block: SpecialBlock) -> Markup:
        match block:
            case model.Callout():
                title = self.inlines(block.title)
                inner = self.render_blocks(block.blocks)
                return Markup(f"<blockquote>\n<p>{title}</p>\n{inner}</blockquote>\n")
            case model.Recording():
                caption = Markup(f"<p>{self.inlines(block.caption)}</p>\n")
                if isinstance(block.body, model.Table):
                    return caption + self.render_blocks((block.body,))
                return caption + self.code("text", block.body.text)
            case model.FeatureBlock():
                return self.render_blocks(block.child_blocks())
            case _:
                return self.code(type(block).__name__, block.code.text)


def format_text(text: str, width: int, lesson: bool = True) -> Parsed[str]:
    source = Source("content/lessons/1.1-a.md", text)
    return format_document(source, KINDS, lesson=lesson, width=width)


def check_formatting(text: str, width: int, lesson: bool) -> None:
    """Check that a reader sees the same, and that formatting once more changes nothing."""
    result = format_text(text, width, lesson)
    if result.diagnostics:
        assert result.value == text
    else:
        assert reader_view(result.value, lesson) == reader_view(text, lesson)
        assert format_text(result.value, width, lesson) == Parsed(result.value)


def reader_view(text: str, lesson: bool) -> list[object]:
    """Return the page as HTML, with white space folded outside of code, and the JSON in fences."""
    document = parse_document(Source("content/lessons/1.1-a.md", text), KINDS, lesson=lesson).value
    parts = re.split(r"(<pre.*?</pre>)", str(plain_html(document)), flags=re.DOTALL)
    html = [part if part.startswith("<pre") else " ".join(part.split()) for part in parts]
    fences = [b.span.text.split("\n", 1)[1] for b in document.blocks if isinstance(b, Lab | Quiz)]
    return [html, *(json.loads(text[:-3]) for text in fences if text.startswith("{"))]
