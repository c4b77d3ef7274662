"""Takes the definition of a term from its paragraph: two sentences.

Entry points: `definition_of(inlines, term)`, `runs_on(definition)`.

A sentence ends at a full stop, a question or exclamation mark, with closing marks, before white
space; not after an initial or a usual abbreviation, and not before a small letter. The marks of
Chinese and Japanese need no white space.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from coursebuild.core import model

_END = re.compile(r"[.!?…؟।]+[\"'”’»)\]]*\s+|[。！？]+[」』）”’]*\s*")
_COMPLETE = re.compile(r"[.!?…؟।。！？][\"'”’»」』）)\]]*\s*$")
_LAST_WORD = re.compile(r"[^\s(\[“‘\"']*$")
_ABBREVIATIONS = frozenset(
    "approx. ca. cf. ch. e.g. eq. eqs. fig. figs. i.e. p. pp. ref. refs. resp. sec. viz. vs."
    " d.h. z.b. bzw. vgl. abb. gl. p.ej. u.a.".split()
)
_OBJECT = "\ufffc"
"""A character in place of content that is not text."""


def definition_of(inlines: tuple[model.Inline, ...], term: model.Term) -> tuple[model.Inline, ...]:
    """Return the sentence of a term and the next one, unless that defines another term."""
    texts = [_plain_text(inline) for inline in inlines]
    index = next(n for n, inline in enumerate(inlines) if term in model.walk_inlines((inline,)))
    term_start = sum(map(len, texts[:index]))
    text = "".join(texts)
    ends = [0, *_sentence_ends(text), len(text)]
    start = max(end for end in ends if end <= term_start)
    stop, *later = (end for end in ends if end > term_start)
    sentence = tuple(_slice(inlines, texts, start, stop))
    following = tuple(_slice(inlines, texts, stop, later[0])) if later else ()
    has_term = any(isinstance(inline, model.Term) for inline in model.walk_inlines(following))
    return sentence if has_term else sentence + following


def runs_on(definition: tuple[model.Inline, ...]) -> bool:
    """Whether a definition continues after its paragraph."""
    return _COMPLETE.search("".join(map(_plain_text, definition))) is None


def _plain_text(inline: model.Inline) -> str:
    """Return the text of an inline that matters for the ends of sentences."""
    match inline:
        case model.Text():
            return inline.text
        case model.SoftBreak() | model.HardBreak():
            return " "
        case model.FootnoteRef() | model.RawInline():
            return ""
        case model.CodeSpan() | model.NumberBinding():
            return _OBJECT
        case _:
            parts = model.walk_inlines((inline,))
            texts = [part.text for part in parts if isinstance(part, model.Text)]
            return _OBJECT + (texts[-1][-1:] if texts else "")


def _sentence_ends(text: str) -> Iterator[int]:
    for mark in _END.finditer(text):
        end = mark.end()
        next_character = text[end : end + 1]
        goes_on = next_character.islower() or _ends_with_abbreviation(text[: mark.start() + 1])
        if mark[0][0] in "。！？" or not goes_on:
            yield end


def _ends_with_abbreviation(text: str) -> bool:
    """Whether the full stop at the end of a text is that of an abbreviation or an initial."""
    word = _LAST_WORD.search(text)
    if word is None or not text.endswith("."):
        return False
    return word[0].lower() in _ABBREVIATIONS or (len(word[0]) == 2 and word[0][0].isalpha())


def _slice(
    inlines: tuple[model.Inline, ...], texts: list[str], start: int, stop: int
) -> Iterator[model.Inline]:
    """Yield the inlines between two offsets of their text."""
    offset = 0
    for inline, text in zip(inlines, texts, strict=True):
        first, last = max(start - offset, 0), min(stop - offset, len(text))
        if isinstance(inline, model.Text):
            if first < last:
                yield model.Text(inline.span, inline.text[first:last])
        elif first < last or (not text and start < offset < stop):
            yield inline
        offset += len(text)
