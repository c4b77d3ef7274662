"""Blocks of other tools, which readers would see as they are written.

Entry points: `check_marks`, for the lines of a paragraph; `check_kind`, for a fence that is shown
as code.
"""

from __future__ import annotations

from collections.abc import Iterator

from coursebuild.core.registry import CORE_FENCES, fence_names, missing_package
from coursebuild.core.syntax.fence import Fence, kind_of, split_words
from coursebuild.core.syntax.nodes import shorten
from coursebuild.core.text.diagnostics import Diagnostic, diagnose
from coursebuild.core.text.source import Excerpt

_CALLOUT = "a callout is a quotation: `> [!note]`, and `> ` before each line of it"
_TEXT = "write the text itself, or put it into backticks if readers should see it"
_TABS = "tabs are a feature: install `coursebuild[tabs]`"
_INCLUDE = "write the text itself; a fence with `source=` shows a part of a file"
_MARKS = {
    "!!! ": ("an admonition of MkDocs", _CALLOUT),
    "??? ": ("an admonition of MkDocs", _CALLOUT),
    "???+ ": ("an admonition of MkDocs", _CALLOUT),
    '=== "': ("a tab of MkDocs", _TABS),
    '--8<-- "': ("a snippet of MkDocs", _INCLUDE),
    "[TOC]": ("a mark of Python-Markdown", "remove it: each page lists its headings by itself"),
    ":::": ("a directive of Docusaurus, MyST, Pandoc or Quarto", _CALLOUT),
    "{%": ("a tag of Jekyll, Jinja or Liquid", _TEXT),
    "{{<": ("a shortcode of Hugo or Quarto", _TEXT),
    "{{%": ("a shortcode of Hugo", _TEXT),
    "{{#": ("a directive of mdBook", _INCLUDE),
    ".. note::": ("a directive of reStructuredText", _CALLOUT),
    ".. warning::": ("a directive of reStructuredText", _CALLOUT),
    ".. code-block::": ("a directive of reStructuredText", "code stands between two fences"),
    ".. math::": ("a directive of reStructuredText", "a formula stands between two `$$`"),
    ".. image::": ("a directive of reStructuredText", "write `![what it shows](x.svg)`"),
    ".. figure::": ("a directive of reStructuredText", "write `![what it shows](x.svg)`"),
    ".. toctree::": ("a directive of reStructuredText", "content/course.toml lists the lessons"),
}
"""How blocks of other tools begin: what each is, and what to write in its place."""
_FIRST_LETTERS = "".join({mark[0] for mark in _MARKS})


def check_marks(content: Excerpt, start: int, text: str) -> Iterator[Diagnostic]:
    """Warn of a mark of another tool, if this text of a block's content begins a line with one.

    The end of a block is no second mistake, and a sentence after `!!!` none at all.
    """
    if text[0] not in _FIRST_LETTERS or content.text[:start].rpartition("\n")[2].strip():
        return
    line = content.text[start:].partition("\n")[0].rstrip()
    for mark, (subject, help) in _MARKS.items():
        rest = line.removeprefix(mark)
        if rest != line and line.strip(":") and not rest[:1].isupper():
            message = f"`{shorten(line)}` would be shown as written: it is {subject}"
            place = content.span(start, start + len(line))
            yield diagnose("markup-foreign", place, message, help=help)
            return


def is_known_kind(kind: str) -> bool:
    """Whether a block of a kind is more than code to be shown."""
    return kind in CORE_FENCES or kind in fence_names()


def check_kind(fence: Fence) -> Iterator[Diagnostic]:
    """Report what is wrong with the first line of a block that is shown as code."""
    package, kind = missing_package(fence.kind), kind_of(fence.info)
    if package:
        message = f"nothing that is installed reads a block of kind `{fence.kind}`"
        yield diagnose("feature-missing", fence.head, message, help=f"install {package}")
    words = split_words(fence.info).value
    if any(word.key == "file" and (word.value or "").endswith(".py") for word in words):
        message = f"a block of kind `{kind.text}` is shown but never run, and this one has a `file`"
        help = "a script is a block of kind `python`"
        yield diagnose("script-kind", kind.span(), message, help=help)
    elif kind.text.startswith("{"):
        message = f"a block of kind `{kind.text}` is shown as code: braces are read by MyST, Quarto"
        help = "write the kind alone, as in ```` ```python file=examples/a.py ````; " + _CALLOUT
        yield diagnose("markup-foreign", kind.span(), message, help=help)
    elif "=" in kind.text:
        message = f"the kind of this block is missing before `{kind.text}`"
        help = "the first word says what a block is, as in ```` ```python file=examples/a.py ````"
        yield diagnose("fence-info", kind.span(), message, help=help)
