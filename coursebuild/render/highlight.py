"""Code as HTML: tokens in a handful of classes, and no character that HTML forbids.

Entry points: `highlight(language, code)`, `highlight_lines`.

1. Pygments tells tokens apart far finer than a page should show; they are folded into few kinds,
   and what belongs to none gets no element at all. Python, which most pages have, is read by
   `python_lexer` instead.
2. Characters that HTML forbids (control characters, non-characters) are shown as the symbols that
   stand for them.
"""

from __future__ import annotations

from collections.abc import Iterable
from html import escape

from markupsafe import Markup

from coursebuild.patterns import pattern
from coursebuild.render.characters import visible as visible

PYTHON = frozenset(("python", "py", "sage", "python3", "py3", "bazel", "starlark", "pyi"))
"""All names under which Pygments knows Python."""
_BEGIN = pattern("\x01(.)")
_ALIASES = {"mjcf": "xml", "urdf": "xml"}


def highlight(language: str, code: str) -> Markup:
    """The code with its tokens marked; plain escaped text where no lexer knows the language."""
    return Markup("\n".join(highlight_lines(language, code)))


def highlight_lines(language: str, code: str) -> tuple[Markup, ...]:
    """The code's lines, each marked by itself: no element reaches over the end of a line."""
    text, language = visible(code), language.lower()
    # Lexers drop a byte order mark at the start.
    mark = "\ufeff" if text.startswith("\ufeff") else ""
    runs = _runs(_ALIASES.get(language, language), text.removeprefix(mark))
    html = escape(text, quote=False) if runs is None else marked([("", mark), *runs])
    return tuple(map(Markup, html.split("\n")))


def _runs(language: str, text: str) -> list[tuple[str, str]] | None:
    if language in PYTHON:
        from coursebuild.render.python_lexer import python_runs

        return python_runs(text)
    if language in ("", "text"):
        return None
    from coursebuild.render.lexers import runs

    return runs(language, text)


def marked(runs: Iterable[tuple[str, str]]) -> str:
    """The HTML of runs of text, each with its class or none.

    What is of one class and meets on a line gets one element.
    """
    parts: list[str] = []
    css, run = "", ""
    for kind, text in runs:
        if kind == css or not text or (text.isspace() and "\n" not in text):
            run += text
        else:
            parts.append(_elements(css, run) if css else run)
            css, run = kind, text
    parts.append(_elements(css, run) if css else run)
    html = "".join(parts).replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
    for css in sorted(set(_BEGIN.findall(html))):
        html = html.replace(f"\x01{css}", f'<span class="{css}">')
    return html.replace("\x02", "</span>")


def _elements(css: str, text: str) -> str:
    """An element on each line; white space around it stays outside.

    Elements are written as characters that no text has (see `visible`), until all is escaped.
    """
    if "\n" in text:
        return "\n".join(_elements(css, line) for line in text.split("\n"))
    core = text.strip()
    if not core:
        return text
    before, _, after = text.partition(core)
    return f"{before}\x01{css}{core}\x02{after}"
