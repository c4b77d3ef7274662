"""Messages to the author: diagnostics, their notes and edits, and the `Parsed` values with them.

Entry point: `diagnose(rule, span, message, …)`. A rule is a member of the closed catalogue
`RULES`; its severity comes from there, so that a rule means the same wherever it
is raised. A message says what is wrong and where, in lower case without a full stop; `help` says
how to mend it.
"""

from __future__ import annotations

import functools
from collections.abc import Iterable
from typing import Generic, TypeVar

from msgspec import Struct

from coursebuild.core.text.rules import RULES, Severity
from coursebuild.core.text.source import Span

T_co = TypeVar("T_co", covariant=True)


class Note(Struct, frozen=True):
    """A further remark, and where it points (if anywhere)."""

    message: str
    span: Span | None = None


class Edit(Struct, frozen=True):
    """A replacement of the text of `span` by `text`."""

    span: Span
    text: str


class Diagnostic(Struct, frozen=True):
    """One mistake or doubt, at one place."""

    rule: str
    """A name of the catalogue."""
    span: Span
    """The smallest stretch of text that is wrong."""
    message: str
    label: str = ""
    """A remark beside the marked text."""
    help: str = ""
    """How to mend it."""
    notes: tuple[Note, ...] = ()
    edits: tuple[Edit, ...] = ()
    """A correction, where one is certain enough to be offered."""
    strict: bool = False
    """Whether it is an error even if its rule is a warning."""

    @property
    def severity(self) -> Severity:
        """The severity of its rule, or of every rule where warnings count as errors."""
        return "error" if self.strict else RULES[self.rule].severity

    @property
    def is_error(self) -> bool:
        """Whether it keeps the site from being published."""
        return self.severity == "error"

    @property
    def order(self) -> tuple[str, int, int, str, str]:
        """The total order in which diagnostics are shown: file, place, rule, text."""
        return (self.span.path, self.span.start, self.span.end, self.rule, self.message)


def diagnose(
    rule: str,
    span: Span,
    message: str,
    *,
    label: str = "",
    help: str = "",
    notes: Iterable[Note] = (),
    edits: Iterable[Edit] = (),
) -> Diagnostic:
    """A diagnostic of a rule of the catalogue.

    Raises:
        KeyError: there is no such rule.
        TypeError: the place is no span.
    """
    if not isinstance(span, Span):
        raise TypeError("the place of a diagnostic is a Span, as `excerpt.span()` gives it")
    if rule not in RULES:
        raise KeyError(f"no rule {rule!r} in the catalogue")
    return Diagnostic(rule, span, message, label, help, tuple(notes), tuple(edits))


class Parsed(Struct, Generic[T_co], frozen=True):
    """The value that a stage made of its input, and its diagnostics."""

    value: T_co
    diagnostics: tuple[Diagnostic, ...] = ()


def nearest(name: str, names: Iterable[str], *, cutoff: float = 0.6) -> str | None:
    """The one of `names` that is most like `name`, if any is alike enough; of several the first.

    Numbers are never alike: `1.3` is another lesson than `1.2`, not a misspelt one.
    """
    import difflib

    if not any(map(str.isalpha, name)):
        return None
    matches = difflib.get_close_matches(name, sorted(set(names)), n=1, cutoff=cutoff)
    return matches[0] if matches else None


def misspelt(word: str, names: Iterable[str]) -> str | None:
    """The one of `names` that a word differs from by a letter, or by two if the name is long.

    A letter may be dropped, added, changed or swapped with the next one, or be a capital.
    """
    import difflib

    lower = word.lower()
    for name in sorted(set(names) - {word}):
        blocks = difflib.SequenceMatcher(None, lower, name.lower(), False).get_matching_blocks()
        difference = max(len(word), len(name)) - sum(block.size for block in blocks)
        if difference <= (1 if len(name) < 5 else 2) and difference < len(name):
            return name
    return None


LETTERS = "abcdefghijklmnopqrstuvwxyz_"
"""What names are made of."""
_ROWS = (
    "1234567890-=", "qwertyuiop[]", "asdfghjkl;'", "zxcvbnm,./", "qwertzuiop", "azertyuiop",
    "ASDFGHJKL", "QWERTYUIOP", "ZXCVBNM<>?",
)  # fmt: skip
_NEARBY = {
    key: {
        row[n]
        for row in _ROWS
        if key in row
        for n in (row.index(key) - 1, row.index(key) + 1)
        if 0 <= n < len(row) and {key, row[n]} != {"x", "z"}
    }
    for key in "".join(_ROWS)
    if not key.isdigit()
}
"""The keys beside each on usual keyboards; `x` and `z` are names of axes."""


@functools.lru_cache(maxsize=256)
def slips_of(name: str) -> frozenset[str]:
    """What a hand may have meant that doubled, swapped, mistyped or dropped one letter of a name.

    Of 3,238 words that strangers' pages have once in inline code, some 10 are such a slip of a name
    of MuJoCo or of the page itself, and half of these are mistakes. Plurals are none, and short
    names differ in their first letter.
    """
    slips: set[str] = set()
    for n, letter in enumerate(name):
        head, tail = name[:n], name[n + 1 :]
        if n and letter == name[n - 1] and letter.isalpha():
            slips.add(head + tail)
        if tail:
            slips.add(head + tail[0] + letter + tail[1:])
        if n or len(name) > 4:
            slips |= {head + dropped + letter + tail for dropped in (*LETTERS, "-", "/", ".")}
            slips |= {
                head + near + tail for near in _NEARBY.get(letter, "") if tail or head[-1] != "e"
            }
    slips |= {name + letter for letter in LETTERS if letter != "s" or name.endswith("s")}
    return frozenset(slips - {name})


def did_you_mean(name: str, known_names: Iterable[str]) -> str:
    """A help text that proposes the nearest known name, or lists the names if they are few.

    Empty where they are many and none is near.
    """
    names = sorted(set(known_names))
    likely = nearest(name, names)
    if likely is not None:
        return f"did you mean `{likely}`?"
    if names and len(names) <= 12:
        return "known: " + ", ".join(f"`{n}`" for n in names)
    return ""


def sort_diagnostics(diagnostics: Iterable[Diagnostic]) -> tuple[Diagnostic, ...]:
    """The diagnostics in their total order, each once."""
    unique = {(d.order, d.help): d for d in diagnostics}
    return tuple(sorted(unique.values(), key=lambda d: d.order))
