"""Contents that can be read at a glance: text, line ends, formulas, code, words in emphasis.

Entry point: `simple_inlines`. More than half of all paragraphs and nearly all cells of tables and
texts of quizzes hold nothing else. For these markdown-it's tokens, and the pass over them
(`inlines`), would take several times as long. Whatever is unusual in the least, a dollar sign that
opens no formula or a blank at a line end, is left to them, so that nothing of it is decided in two
places; a property test compares what both give.
"""

from __future__ import annotations

from coursebuild.model import CodeSpan, Emphasis, Inline, Math, SoftBreak, Strong, Text
from coursebuild.source import Excerpt
from coursebuild.syntax.inline_parser import next_mark
from coursebuild.syntax.math import find_formula
from coursebuild.syntax.mention import Item, may_mention, with_mentions
from coursebuild.syntax.spans import Placer


def simple_inlines(content: Excerpt, *, mentions: bool = True) -> tuple[Inline, ...] | None:
    """The inlines of a block's content; `None` where it is not one of these.

    There is no mistake in it then. `mentions` says whether "Lesson 2.2" becomes a link.
    """
    text = content.text
    at = next_mark(text, 0)
    if mentions and may_mention(text):
        if at >= 0:
            return None
        return tuple(with_mentions([Item(text, 0, len(text))], Placer(content)))
    if at < 0:
        return (Text(content.span(), text),) if text else ()
    placer = Placer(content)
    nodes: list[Inline] = []
    done = 0
    while at >= 0:
        found = _marked(content, placer, at)
        if found is None:
            return None
        if at > done:
            nodes.append(Text(placer.span(done, at), text[done:at]))
        node, done = found
        nodes.append(node)
        at = next_mark(text, done)
    if done < len(text):
        nodes.append(Text(placer.span(done, len(text)), text[done:]))
    return tuple(nodes)


def _marked(content: Excerpt, placer: Placer, at: int) -> tuple[Inline, int] | None:
    """What the mark at `at` begins, and where that ends."""
    mark = content.text[at]
    if mark == "$":
        return _formula(content, placer, at)
    if mark == "`":
        return _code(content.text, placer, at)
    if mark == "\n":
        return _line_end(content.text, placer, at)
    if mark == "*" or mark == "_":
        return _emphasis(content.text, placer, at, mark)
    return None


def _formula(content: Excerpt, placer: Placer, at: int) -> tuple[Math, int] | None:
    text = content.text
    if text.startswith("$$$", at):
        return None
    formula = find_formula(text, at, len(text))
    if formula is None:
        return None
    start, end, after, display = formula
    tex = text[start:end]
    if "`" in tex or not tex.strip() or "{" in text[after : after + 4]:
        return None
    return Math(placer.span(at, after), content.slice(start, end), display), after


def _code(text: str, placer: Placer, at: int) -> tuple[CodeSpan, int] | None:
    end = text.find("`", at + 1)
    code = text[at + 1 : end]
    if end < 0 or not code or code[0] == " " or "\n" in code or text[end + 1 : end + 2] in _AFTER:
        return None
    return CodeSpan(placer.span(at, end + 1), code), end + 1


_AFTER = ("`", "{")
"""What a piece of code may not end before: more backticks, and what may be `{out}`."""


def _emphasis(
    text: str, placer: Placer, at: int, mark: str
) -> tuple[Emphasis | Strong, int] | None:
    """Emphasis of plain words between spaces.

    The first marks can only open and the second can only close. Nothing is between them, so that
    they are a pair whatever stands around them.
    """
    width = 2 if text.startswith(mark, at + 1) else 1
    start, marks = at + width, mark * width
    end = next_mark(text, start)
    after = end + width
    if (
        end < 0
        or not text.startswith(marks, end)
        or not (text[start].isalnum() and text[end - 1].isalnum())
        or (at > 0 and text[at - 1] not in _BEFORE_WORDS)
        or (after < len(text) and text[after] not in _AFTER_WORDS)
    ):
        return None
    children = (Text(placer.span(start, end), text[start:end]),)
    span = placer.span(at, after)
    return (Emphasis if width == 1 else Strong)(span, children), after


_BEFORE_WORDS = (" ", "\n", "(")
_AFTER_WORDS = (" ", "\n", ".", ",", ";", ":", ")", "?")


def _line_end(text: str, placer: Placer, at: int) -> tuple[SoftBreak, int] | None:
    if text[at - 1 : at] == " " or text[at + 1 : at + 2] in (" ", "\t"):
        return None
    return SoftBreak(placer.span(at, at + 1)), at + 1
