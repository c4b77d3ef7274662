r"""Info strings of fences: `kind [name] [key=value | key="value with spaces" | flag]…`.

Entry points: `read_keys`, which compares the words after the kind with the keys that it has (for a
`Fence`, call its method `keys`); `split_words`, which only splits.

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
_SPACED_OPTION = re.compile(
    r"""[^\s="]+(?:\s+(=)\s*|(=)\s+)(?:"(?:\\["\\]|[^"])*"|[^\s"=]+)(?=\s|$)"""
)
_KIND = re.compile(r"\s*(\S*)")
_NOT_SPACE = re.compile(r"\S")
_REST = re.compile(r"\S*")
_PART = re.compile(r"(?:^|(?<=,))[^,]*")
_ESCAPE = re.compile(r"""\\(["\\])""")


_NO_TITLE = "a block has no title: write it into the text above"
_NO_NUMBERS = "the lines of a block are not numbered: leave it out"
_NO_MARKS = "lines are not highlighted: leave it out, and say in the text which ones matter"
_FOREIGN_KEYS = {
    **dict.fromkeys(("caption", "filename", "title"), _NO_TITLE),
    **dict.fromkeys(("linenos", "linenostart", "linenums", "startline"), _NO_NUMBERS),
    **dict.fromkeys(("emphasize-lines", "highlight", "hl_lines"), _NO_MARKS),
}
"""Keys of MkDocs and others, with what to do instead."""


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
        """The parts of a value between its commas, without white space at their ends."""
        value = self.value_text
        if value is None:
            return []
        return [trim(value.slice(*match.span())) for match in _PART.finditer(value.text)]


class FenceKeys(Struct, frozen=True):
    """The name and the keys of an info string."""

    name: Word | None
    """The first word after the kind, if it is a name."""
    words: tuple[Word, ...]
    """The words whose keys the kind has, each key once."""

    def get(self, key: str) -> Word | None:
        """The word of a key, if it is given."""
        return next((word for word in self.words if word.key == key), None)

    def value(self, key: str) -> str | None:
        """The value of a key, if it is given."""
        word = self.get(key)
        return None if word is None else word.value

    def place(self, key: str) -> Span | None:
        """The span of the value of a key, if it is given."""
        word = self.get(key)
        return None if word is None else word.value_span


def kind_of(info: Excerpt) -> Excerpt:
    """The first word of an info string."""
    match = _KIND.match(info.text)
    return info.slice(*match.span(1)) if match else info


def read_keys(
    info: Excerpt, *, values: Sequence[str] = (), flags: Sequence[str] = (), has_name: bool = False
) -> Parsed[FenceKeys]:
    """Read the keys of a fence: those in `values` take a value, `flags` none, those in both may.

    With `has_name` a first word without `=` is a name.
    """
    kind, split = kind_of(info).text, split_words(info)
    words, diagnostics = list(split.value), list(split.diagnostics)
    name = words.pop(0) if has_name and words and words[0].value is None else None
    keys = [*values, *flags]
    words_by_key: dict[str, Word] = {}
    for word in words:
        key = word.key
        if key not in keys and (foreign := check_foreign_key(kind, word)) is not None:
            diagnostics.append(foreign)
        elif key not in keys:
            message = f"`{kind}` has no key `{key}`" if keys else f"`{kind}` takes no keys"
            help = did_you_mean(key, keys)
            diagnostics.append(diagnose("fence-key-unknown", word.key_span, message, help=help))
        elif key in words_by_key:
            notes = [Note("first given here", words_by_key[key].key_span)]
            message = f"`{key}` is given twice"
            diagnostics.append(diagnose("fence-key-repeated", word.key_span, message, notes=notes))
        elif key not in values and word.value is not None:
            message, help = f"`{key}` takes no value", f"write `{key}` alone"
            diagnostics.append(diagnose("fence-key-value", word.span, message, help=help))
        elif word.value == "" or (key not in flags and word.value is None):
            message, help = f"`{key}` needs a value", f"write `{key}=…`"
            diagnostics.append(diagnose("fence-key-value", word.span, message, help=help))
        else:
            words_by_key[key] = word
    return Parsed(FenceKeys(name, tuple(words_by_key.values())), tuple(diagnostics))


def check_foreign_key(kind: str, word: Word) -> Diagnostic | None:
    """The diagnostic of a key that only other tools read."""
    help = _FOREIGN_KEYS.get(word.key.lower())
    if help is None or word.value is None:
        return None
    if kind == "python" and help == _NO_TITLE:
        help += "; a script has `file=examples/….py`, which is shown above it"
    message = f"`{kind}` has no key `{word.key}`"
    return diagnose("fence-key-unknown", word.key_span, message, help=help)


def split_words(info: Excerpt) -> Parsed[tuple[Word, ...]]:
    """The words after the kind, whatever their keys."""
    words: list[Word] = []
    diagnostics: list[Diagnostic] = []
    text, kind = info.text, kind_of(info).text
    at = len(text) - len(text.lstrip()) + len(kind)
    while start_match := _NOT_SPACE.search(text, at):
        at = start_match.start()
        match = _WORD.match(text, at)
        assert match is not None
        end = match.end()
        if spaced_word := _SPACED_OPTION.match(text, at):
            equals, end = spaced_word.start(spaced_word.lastindex or 0), spaced_word.end()
            message = "there is a space beside the `=` of a key"
            diagnostics.append(diagnose("fence-info", info.span(equals, equals + 1), message))
        elif end < len(text) and not text[end].isspace():
            diagnostic, end = _diagnose_malformed(info, at, end)
            diagnostics.append(diagnostic)
        elif not match[1]:
            message = f"`{match[0]}` has no key before the `=`"
            diagnostics.append(diagnose("fence-info", info.span(at, end), message))
        else:
            words.append(_build_word(info, match))
        at = end
    return Parsed(tuple(words), tuple(diagnostics))


def _diagnose_malformed(info: Excerpt, at: int, end: int) -> tuple[Diagnostic, int]:
    """The diagnostic of a word that cannot be read, and where to go on."""
    text = info.text
    if text[end] == '"' and text.count('"', end) == 1:
        message, help = "a quoted value is never closed", 'close it with `"`'
        span = info.span(end, len(text))
        return diagnose("fence-info", span, message, help=help), len(text)
    rest = _REST.match(text, end)
    word_end = rest.end() if rest else end
    message = f"`{text[at:word_end]}` cannot be read"
    help = 'write `key=value`, `key="value with spaces"` or a flag, with spaces between them'
    return diagnose("fence-info", info.span(at, word_end), message, help=help), word_end


def _build_word(info: Excerpt, match: re.Match[str]) -> Word:
    value = info.slice(*match.span(match.lastindex or 0)) if match[2] else None
    if value is not None and match[3]:
        value = _unescape(value)
    return Word(info.span(*match.span()), match[1], info.span(*match.span(1)), value)


def _unescape(value: Excerpt) -> Excerpt:
    """A quoted value without its backslashes."""
    escapes = [(match.start(), match.start(1)) for match in _ESCAPE.finditer(value.text)]
    starts, ends = [0, *(b for _, b in escapes)], [*(a for a, _ in escapes), len(value.text)]
    return Excerpt.join([value.slice(a, b) for a, b in zip(starts, ends, strict=True)])
