r"""Info strings of fences: `kind [name] [key=value | key="value with spaces" | flag]…`.

Entry point: `read_keys`, the words after the kind against the keys that it has; `Fence.keys` is the
same for a fence at hand. `split_words` splits without a judgement.

In a quoted value `\"` is a quote and `\\` a backslash. Mistakes are diagnostics at the word that
is wrong; the rest is still read.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from msgspec import Struct

from coursebuild.core.syntax.spans import trim
from coursebuild.core.text.diagnostics import Diagnostic, Note, Parsed, diagnose, did_you_mean
from coursebuild.core.text.source import Excerpt, Span

_WORD = re.compile(r"""([^\s="]*)(?:(=)(?:"((?:\\["\\]|[^"])*)"|([^\s"]*)))?""")
_SPACED = re.compile(r"""[^\s="]+(?:\s+(=)\s*|(=)\s+)(?:"(?:\\["\\]|[^"])*"|[^\s"=]+)(?=\s|$)""")
_KIND = re.compile(r"\s*(\S*)")
_BLACK = re.compile(r"\S")
_REST = re.compile(r"\S*")
_PART = re.compile(r"(?:^|(?<=,))[^,]*")
_ESCAPE = re.compile(r"""\\(["\\])""")


class Word(Struct, frozen=True):
    """A word of an info string: `key`, or `key=value`."""

    span: Span
    key: str
    key_span: Span
    value_text: Excerpt | None
    """The value with its places; `None` for a word without `=`."""

    @property
    def value(self) -> str | None:
        """The value as text."""
        return None if self.value_text is None else self.value_text.text

    @property
    def value_span(self) -> Span:
        """Where the value stands; the word itself when it has none."""
        return self.span if self.value_text is None else self.value_text.span()

    def parts(self) -> list[Excerpt]:
        """The parts of a value that have commas between them, without white space around them."""
        value = self.value_text
        found = () if value is None else _PART.finditer(value.text)
        return [] if value is None else [trim(value.slice(*part.span())) for part in found]


class FenceKeys(Struct, frozen=True):
    """What an info string says beside the kind."""

    name: Word | None
    """The first word, where it is a name."""
    words: tuple[Word, ...]
    """Those whose keys the kind has, each key once."""

    def get(self, key: str) -> Word | None:
        """The word of a key, if it is given."""
        return next((word for word in self.words if word.key == key), None)

    def value(self, key: str) -> str | None:
        """The value of a key, if it is given."""
        word = self.get(key)
        return None if word is None else word.value

    def place(self, key: str) -> Span | None:
        """Where the value of a key stands, if it is given."""
        word = self.get(key)
        return None if word is None else word.value_span


def kind_of(info: Excerpt) -> Excerpt:
    """The first word of an info string."""
    found = _KIND.match(info.text)
    return info.slice(*found.span(1)) if found else info


def read_keys(
    info: Excerpt, *, values: Sequence[str] = (), flags: Sequence[str] = (), has_name: bool = False
) -> Parsed[FenceKeys]:
    """Sort the words of a fence of ours: which keys take a value, which are flags, which are both.

    With `has_name` a first word without `=` is a name.
    """
    kind, split = kind_of(info).text, split_words(info)
    words, diagnostics = list(split.value), list(split.diagnostics)
    name = words.pop(0) if has_name and words and words[0].value is None else None
    known = [*values, *flags]
    kept: dict[str, Word] = {}
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
        elif key not in values and word.value is not None:
            message, help = f"`{key}` takes no value", f"write `{key}` alone"
            diagnostics.append(diagnose("fence-key-value", word.span, message, help=help))
        elif word.value == "" or (key not in flags and word.value is None):
            message, help = f"`{key}` needs a value", f"write `{key}=…`"
            diagnostics.append(diagnose("fence-key-value", word.span, message, help=help))
        else:
            kept[key] = word
    return Parsed(FenceKeys(name, tuple(kept.values())), tuple(diagnostics))


def split_words(info: Excerpt) -> Parsed[tuple[Word, ...]]:
    """The words after the kind."""
    words: list[Word] = []
    diagnostics: list[Diagnostic] = []
    text, kind = info.text, kind_of(info).text
    at = len(text) - len(text.lstrip()) + len(kind)
    while black := _BLACK.search(text, at):
        at = black.start()
        found = _WORD.match(text, at)
        assert found is not None
        end = found.end()
        if spaced := _SPACED.match(text, at):
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
    return Parsed(tuple(words), tuple(diagnostics))


def _malformed(info: Excerpt, at: int, end: int) -> tuple[Diagnostic, int]:
    """The diagnostic of a word that cannot be read, and where to go on."""
    text = info.text
    if text[end] == '"' and text.count('"', end) == 1:
        message, help = "a quoted value is never closed", 'close it with `"`'
        span = info.span(end, len(text))
        return diagnose("fence-info", span, message, help=help), len(text)
    rest = _REST.match(text, end)
    after = rest.end() if rest else end
    message = f"`{text[at:after]}` cannot be read"
    help = 'write `key=value`, `key="value with spaces"` or a flag, with spaces between them'
    return diagnose("fence-info", info.span(at, after), message, help=help), after


def _word(info: Excerpt, found: re.Match[str]) -> Word:
    value = info.slice(*found.span(found.lastindex or 0)) if found[2] else None
    if value is not None and found[3]:
        value = _unescaped(value)
    return Word(info.span(*found.span()), found[1], info.span(*found.span(1)), value)


def _unescaped(value: Excerpt) -> Excerpt:
    """A quoted value without its backslashes."""
    escapes = _ESCAPE.finditer(value.text)
    cuts = [0, *(at for found in escapes for at in (found.start(), found.start(1)))]
    ends = [*cuts[1::2], len(value.text)]
    return Excerpt.join([value.slice(a, b) for a, b in zip(cuts[::2], ends, strict=True)])
