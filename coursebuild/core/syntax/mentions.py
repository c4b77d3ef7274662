"""Mentions of lessons and levels in a line of text, as in "Lesson 2.2", which become links.

Text and soft line ends that follow each other make one run, as a mention may be broken over two
lines.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import lru_cache
from itertools import groupby
from typing import NamedTuple

from coursebuild.core.model import Inline, LessonTarget, LevelTarget, Link, SoftBreak, Text
from coursebuild.core.model.course import Words
from coursebuild.core.text.source import Excerpt

_LESSON = r"[0-9]+(?:\.[0-9]+)+(?!\w)"
_LEVEL = r"[0-9]+(?:\.[0-9]+)*(?!\w)"

_NUMBER = re.compile(r"[0-9.]*[0-9]")


class TextPiece(NamedTuple):
    """A stretch of text in a block's content, or a soft line end (`text` is a line feed)."""

    text: str
    start: int
    end: int
    literal: bool = True
    """Whether each character stands for itself; not so for entities and escapes."""


def may_mention(text: str, words: Words) -> bool:
    """Whether a text is worth searching for mentions."""
    return any(word in text for names in _mention_names(words) for word in names)


def _mention_names(words: Words) -> tuple[tuple[str, ...], ...]:
    return words.lesson, words.lessons, words.level, words.levels


@lru_cache(maxsize=8)
def _mentions(words: Words) -> re.Pattern[str]:
    """The pattern of mentions; its group is there if they are of lessons."""
    lesson, lessons, level, levels, conjunctions = (
        "|".join(map(re.escape, names)) for names in (*_mention_names(words), words.conjunctions)
    )
    # Arabic writes "and" and the number without a space.
    joint = rf"(?:[,،]?\s+(?:{conjunctions})\s*|[,،]\s+|\s?[–-]\s?)"
    return re.compile(
        r"(?<![\w\\])(?:"
        rf"((?:{lesson})\s+{_LESSON}|(?:{lessons})\s+{_LESSON}(?:{joint}{_LESSON})*)"
        rf"|(?:{level})\s+{_LEVEL}|(?:{levels})\s+{_LEVEL}(?:{joint}{_LEVEL})*)"
    )


def mentioned_lesson(text: str, words: Words) -> str:
    """The lesson that a whole text mentions; empty for other texts and for several lessons."""
    match, numbers = _mentions(words).fullmatch(text), _NUMBER.findall(text)
    return numbers[0] if match and match[1] and len(numbers) == 1 else ""


def text_inlines(run: Sequence[TextPiece], content: Excerpt) -> list[Inline]:
    """The run as texts and soft line ends."""
    inlines: list[Inline] = []
    for is_line_end, group in groupby(run, key=lambda piece: piece.text == "\n"):
        pieces = [*group]
        if is_line_end:
            inlines += [SoftBreak(content.span(piece.start, piece.end)) for piece in pieces]
        else:
            span = content.span(pieces[0].start, pieces[-1].end)
            inlines.append(Text(span, "".join([piece.text for piece in pieces])))
    return inlines


def link_mentions(run: Sequence[TextPiece], content: Excerpt, words: Words) -> list[Inline]:
    """The run as texts, soft line ends, and links where it mentions lessons and levels."""
    chars = [
        TextPiece(char, piece.start + i, piece.start + i + 1)
        if piece.literal
        else piece._replace(text=char)
        for piece in run
        for i, char in enumerate(piece.text)
    ]
    text = "".join([char.text for char in chars])
    inlines: list[Inline] = []
    position = 0
    for mentions in _mentions(words).finditer(text):
        for number in _NUMBER.finditer(text, *mentions.span()):
            is_first = position <= mentions.start()  # its link includes the word
            start, end = mentions.start() if is_first else number.start(), number.end()
            inlines += text_inlines(chars[position:start], content)
            target = LessonTarget(number[0], None) if mentions[1] else LevelTarget(number[0])
            children = text_inlines(chars[start:end], content)
            span = content.span(chars[start].start, chars[end - 1].end)
            place = content.span(chars[number.start()].start, chars[end - 1].end)
            inlines.append(Link(span, target, place, "", tuple(children), mention=True))
            position = end
    return inlines + text_inlines(chars[position:], content)
