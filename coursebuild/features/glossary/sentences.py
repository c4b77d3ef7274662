"""What a glossary shows of the paragraph that defines a term: two sentences.

Entry points: `definition_of(inlines, term)`, `runs_on(definition)`.

A sentence ends at a full stop, a question or exclamation mark, with what closes behind it, before
white space; not after an initial or a usual abbreviation, and not before a small letter. The marks
of Chinese and Japanese end one by themselves.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from coursebuild.core import model

_END = re.compile(r"[.!?…؟।]+[\"'”’»)\]]*\s+|[。！？]+[」』）”’]*\s*")
_CLOSED = re.compile(r"[.!?…؟।。！？][\"'”’»」』）)\]]*\s*$")
_LAST_WORD = re.compile(r"[^\s(\[“‘\"']*$")
_ABBREVIATIONS = frozenset(
    "approx. ca. cf. ch. e.g. eq. eqs. fig. figs. i.e. p. pp. ref. refs. resp. sec. viz. vs."
    " d.h. z.b. bzw. vgl. abb. gl. p.ej. u.a.".split()
)
_OBJECT = "\ufffc"
"""Stands for what is no text."""


def definition_of(inlines: tuple[model.Inline, ...], term: model.Term) -> tuple[model.Inline, ...]:
    """The sentence in which a term stands and the next one, unless that defines another term."""
    texts = [_shown(inline) for inline in inlines]
    at = next(n for n, inline in enumerate(inlines) if term in model.walk_inlines((inline,)))
    place = sum(map(len, texts[:at]))
    whole = "".join(texts)
    ends = [0, *_ends(whole), len(whole)]
    start = max(end for end in ends if end <= place)
    stop, *later = (end for end in ends if end > place)
    sentence = tuple(_cut(inlines, texts, start, stop))
    following = tuple(_cut(inlines, texts, stop, later[0])) if later else ()
    defines = any(isinstance(inline, model.Term) for inline in model.walk_inlines(following))
    return sentence if defines else sentence + following


def runs_on(definition: tuple[model.Inline, ...]) -> bool:
    """Whether a definition goes on in what follows its paragraph."""
    return _CLOSED.search("".join(map(_shown, definition))) is None


def _shown(inline: model.Inline) -> str:
    """What counts of an inline for where sentences end; a character at least for a formula."""
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
            texts = [
                one.text for one in model.walk_inlines((inline,)) if isinstance(one, model.Text)
            ]
            return _OBJECT + (texts[-1][-1:] if texts else "")


def _ends(text: str) -> Iterator[int]:
    for found in _END.finditer(text):
        end = found.end()
        following = text[end : end + 1]
        goes_on = following.islower() or _abbreviates(text[: found.start() + 1])
        if found[0][0] in "。！？" or not goes_on:
            yield end


def _abbreviates(text: str) -> bool:
    """Whether a full stop at the end of a text is that of an abbreviation or an initial."""
    word = _LAST_WORD.search(text)
    if word is None or not text.endswith("."):
        return False
    return word[0].lower() in _ABBREVIATIONS or (len(word[0]) == 2 and word[0][0].isalpha())


def _cut(
    inlines: tuple[model.Inline, ...], texts: list[str], start: int, stop: int
) -> Iterator[model.Inline]:
    at = 0
    for inline, text in zip(inlines, texts, strict=True):
        first, last = max(start - at, 0), min(stop - at, len(text))
        if isinstance(inline, model.Text):
            if first < last:
                yield model.Text(inline.span, inline.text[first:last])
        elif first < last or (not text and start < at < stop):
            yield inline
        at += len(text)
