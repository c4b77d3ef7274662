r"""Info strings of fences: `kind [name] [key=value | key="value with spaces" | flag]…`.

Entry points: `parse_info` (an info string into words with spans), `read_keys` (those words against
the keys of a kind).

In a quoted value `\"` is a quote and `\\` a backslash. Mistakes are diagnostics at the word that
is wrong; the rest is still read.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from msgspec import Struct

from coursebuild.core.syntax.spans import joined
from coursebuild.core.text.diagnostics import Diagnostic, Note, Parsed, diagnose, did_you_mean
from coursebuild.core.text.source import Excerpt, Span

_WORD = re.compile(r"""([^\s="]*)(?:(=)(?:"((?:\\["\\]|[^"])*)"|([^\s"]*)))?""")
_SPACED = re.compile(r"""[^\s="]+(?:\s+(=)\s*|(=)\s+)(?:"(?:\\["\\]|[^"])*"|[^\s"=]+)(?=\s|$)""")
_SPACES = re.compile(r"\s*")
_NEXT_SPACE = re.compile(r"\s|$")
_ESCAPE = re.compile(r"""\\(["\\])""")


class Word(Struct, frozen=True):
    """A word of an info string: `key`, or `key=value`."""

    span: Span
    key: str
    key_span: Span
    value: str | None
    """`None` for a word without `=`."""
    value_text: Excerpt | None
    """The value with its places."""

    @property
    def value_span(self) -> Span:
        """Where the value stands; the word itself when it has none."""
        return self.span if self.value_text is None else self.value_text.span()


class Info(Struct, frozen=True):
    """An info string; `kind` is its first word."""

    kind: str
    kind_span: Span
    words: tuple[Word, ...]


def first_word(info: str) -> str:
    """The first word of a text; empty where there is none."""
    words = info.split(None, 1)
    return words[0] if words else ""


def kind_of(info: Excerpt) -> Excerpt:
    """The first word of an info string."""
    word, text = first_word(info.text), info.text
    start = len(text) - len(text.lstrip())
    return info.slice(start, start + len(word))


def parse_info(info: Excerpt) -> Parsed[Info]:
    """Split an info string."""
    kind = kind_of(info)
    words: list[Word] = []
    diagnostics: list[Diagnostic] = []
    text = info.text
    at = len(text) - len(text.lstrip()) + len(kind.text)
    while (at := _skip(text, at)) < len(text):
        found = _WORD.match(text, at)
        assert found is not None
        end = found.end()
        spaced = _SPACED.match(text, at)
        if spaced is not None:
            equals, end = spaced.start(spaced.lastindex or 0), spaced.end()
            message = "no space may stand beside the `=` of a key"
            diagnostics.append(diagnose("fence-info", info.span(equals, equals + 1), message))
        elif end < len(text) and not text[end].isspace():
            wrong, end = _malformed(info, at, end)
            diagnostics.append(wrong)
        elif not found[1]:
            message = f"`{found[0]}` has no key before the `=`"
            diagnostics.append(diagnose("fence-info", info.span(at, end), message))
        else:
            words.append(_word(info, found))
        at = end
    return Parsed(Info(kind.text, kind.span(), tuple(words)), tuple(diagnostics))


def _skip(text: str, at: int) -> int:
    found = _SPACES.match(text, at)
    return at if found is None else found.end()


def _malformed(info: Excerpt, at: int, end: int) -> tuple[Diagnostic, int]:
    """The diagnostic of a word that cannot be read, and where to go on."""
    text = info.text
    if text[end] == '"' and text.count('"', end) == 1:
        message, after = "a quoted value is never closed", len(text)
        return diagnose(
            "fence-info", info.span(end, after), message, help='close it with `"`'
        ), after
    found = _NEXT_SPACE.search(text, end)
    after = found.start() if found else len(text)
    message = f"`{text[at:after]}` cannot be read"
    help = 'write `key=value`, `key="value with spaces"` or a flag, with spaces between them'
    return diagnose("fence-info", info.span(at, after), message, help=help), after


def _word(info: Excerpt, found: re.Match[str]) -> Word:
    span = info.span(found.start(), found.end())
    key_span = info.span(found.start(1), found.end(1))
    if found[2] is None:
        return Word(span, found[1], key_span, None, None)
    group = 3 if found[3] is not None else 4
    value = info.slice(found.start(group), found.end(group))
    if group == 3 and "\\" in value.text:
        value = _unescaped(value)
    return Word(span, found[1], key_span, value.text, value)


def _unescaped(value: Excerpt) -> Excerpt:
    """A quoted value without its backslashes."""
    cuts = [
        0,
        *(i for m in _ESCAPE.finditer(value.text) for i in (m.start(), m.start(1))),
        len(value.text),
    ]
    return joined(value.slice(a, b) for a, b in zip(cuts[::2], cuts[1::2], strict=True)) or value


class FenceKeys(Struct, frozen=True):
    """The keys of a fence that its kind knows, each at most once."""

    words: tuple[Word, ...]

    def get(self, key: str) -> Word | None:
        """The word of a key, if it is given."""
        return next((word for word in self.words if word.key == key), None)


def read_keys(
    kind: str, words: Sequence[Word], *, values: Sequence[str] = (), flags: Sequence[str] = ()
) -> Parsed[FenceKeys]:
    """Sort the words of a fence of ours: which keys take a value, which are flags."""
    known = [*values, *flags]
    kept: dict[str, Word] = {}
    diagnostics: list[Diagnostic] = []
    for word in words:
        key = word.key
        if key not in known:
            message = f"`{kind}` has no key `{key}`" if known else f"`{kind}` takes no keys"
            help = did_you_mean(key, known)
            diagnostics.append(diagnose("fence-key-unknown", word.key_span, message, help=help))
        elif key in kept:
            notes = [Note("first given here", kept[key].key_span)]
            message = f"`{key}` is given twice"
            diagnostics.append(diagnose("fence-key-repeated", word.key_span, message, notes=notes))
        elif key in flags and word.value is not None:
            message, help = f"`{key}` takes no value", f"write `{key}` alone"
            diagnostics.append(diagnose("fence-key-value", word.span, message, help=help))
        elif key in values and not word.value:
            message, help = f"`{key}` needs a value", f"write `{key}=…`"
            diagnostics.append(diagnose("fence-key-value", word.span, message, help=help))
        else:
            kept[key] = word
    return Parsed(FenceKeys(tuple(kept.values())), tuple(diagnostics))
