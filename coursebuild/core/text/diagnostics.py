"""Messages to the author: diagnostics, their notes and edits, and the `Parsed` values with them.

A message says what is wrong and where, in lower case without a full stop; `help` says how to mend
it. `coursebuild check --fix` makes the edits of a `Fix` that are safe and change the form of a text
only (`keeps_words`); all others are proposed, for a human to decide.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Iterable
from typing import Generic, TypeVar

from msgspec import Struct

from coursebuild.core.text.near import have_other_ids, nearest
from coursebuild.core.text.regex import regex
from coursebuild.core.text.rules import RULES, Severity
from coursebuild.core.text.source import Source, Span

T_co = TypeVar("T_co", covariant=True)


class Edit(Struct, frozen=True):
    """A replacement of the text of `span` by `text`."""

    span: Span
    text: str


class Note(Struct, frozen=True):
    """A further remark, and where it points (if anywhere)."""

    message: str
    span: Span | None = None
    edits: tuple[Edit, ...] = ()
    """What an author writes to choose this one of several ways."""


class Fix(str):
    """A help with the edits that follow it, where it is known what to write.

    `new` replaces what the diagnostic marks; or `old`, if that stands there once, as it does
    not in a string with escapes. `edits` are of other places. It is `safe` where nothing else
    can be meant.
    """

    new: str | None
    old: str
    edits: tuple[Edit, ...]
    safe: bool

    def __new__(
        cls,
        help: str,
        new: str | None = None,
        old: str = "",
        *,
        edits: tuple[Edit, ...] = (),
        safe: bool = False,
    ) -> Fix:
        """Make a help with its edits."""
        fix = super().__new__(cls, help)
        fix.new, fix.old, fix.edits, fix.safe = new, old, edits, safe
        return fix

    def edits_at(self, place: Span) -> tuple[Edit, ...]:
        """The edits of a diagnostic at this place."""
        if self.new is None:
            return self.edits
        if self.old and place.text.count(self.old) != 1:
            return ()
        start = place.start + place.text.index(self.old)
        end = start + len(self.old) if self.old else place.end
        return (Edit(place.source.span(start, end), self.new), *self.edits)

    def at(self, place: Span) -> Fix:
        """The same for a diagnostic that marks something else than this place."""
        return Fix(self, edits=self.edits_at(place), safe=self.safe)


def write(text: str, old: str = "") -> Fix:
    """The fix that writes a text, and nothing else can be meant."""
    return Fix(f"write `{text}`", text, old, safe=True)


class Diagnostic(Struct, frozen=True):
    """One mistake or doubt, at one place."""

    rule: str
    span: Span
    """The smallest stretch of text that is wrong."""
    message: str
    label: str = ""
    help: str = ""
    notes: tuple[Note, ...] = ()
    edits: tuple[Edit, ...] = ()
    """What mends it, if that is known: all of them, or none."""
    safe: bool = False
    """Whether the edits are what its author meant, beyond doubt, and leave all words alone."""
    strict: bool = False
    """Whether it is an error even if its rule is a warning."""

    @property
    def severity(self) -> Severity:
        """The severity of its rule, or of every rule where warnings count as errors."""
        severity = RULES[self.rule].severity
        return "error" if self.strict and severity == "warning" else severity

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
) -> Diagnostic:
    """A diagnostic of a rule of the catalogue; a `Fix` as its help has the edits as well.

    Raises KeyError for an unknown rule, TypeError for a place that is no span.
    """
    if not isinstance(span, Span):
        raise TypeError("the place of a diagnostic is a Span, as `excerpt.span()` gives it")
    if rule not in RULES:
        raise KeyError(f"no rule {rule!r} in the catalogue")
    edits = help.edits_at(span) if isinstance(help, Fix) else ()
    is_safe = isinstance(help, Fix) and help.safe and bool(edits) and keeps_words(edits)
    return Diagnostic(rule, span, message, label, str(help), tuple(notes), edits, is_safe)


_WORD = regex(r"(?<!\w)[-+\u2212]?\d+(?:[.,]\d+)*|[\u207a\u207b]?\w+")
"""A number with its sign, or a word; names in code are words."""


def keeps_words(edits: Iterable[Edit]) -> bool:
    """Whether edits leave each word and number beside them as it is: they change form only.

    That is: marks and white space between them, and characters that nobody sees.
    """
    by_source: dict[Source, list[Edit]] = {}
    for edit in edits:
        by_source.setdefault(edit.span.source, []).append(edit)
    for source, changes in by_source.items():
        changes.sort(key=lambda edit: edit.span.start)
        first, last = changes[0].span.start, max(edit.span.end for edit in changes)
        start = 1 + source.text.rfind("\n", 0, first)
        old = source.text[start:last] + source.text[last:].partition("\n")[0]
        new, at = "", start
        for edit in changes:
            new += source.text[at : edit.span.start] + edit.text
            at = edit.span.end
        new += source.text[at : start + len(old)]
        if _words(old) != _words(new):
            return False
    return True


def _words(text: str) -> list[str]:
    visible = (char for char in text if char.isspace() or unicodedata.category(char) not in _UNSEEN)
    return _WORD.findall("".join(visible))


_UNSEEN = ("Cc", "Cf")
"""Categories of characters that have no look: of control, and of format."""


class Parsed(Struct, Generic[T_co], frozen=True):
    """The value that a stage made of its input, and its diagnostics."""

    value: T_co
    diagnostics: tuple[Diagnostic, ...] = ()


def did_you_mean(name: str, known_names: Iterable[str], most: int = 12) -> str:
    """The fix that writes the nearest known name, or a help that lists up to `most`; or nothing."""
    names = sorted(set(known_names))
    if (likely := nearest(name, names)) is not None:
        return propose(name, likely)
    return "known: " + ", ".join(f"`{n}`" for n in names) if 0 < len(names) <= most else ""


def propose(name: str, likely: str) -> Fix:
    """The fix that writes the likely name for another one, where its author says so.

    Names that differ in numbers or single letters are of different things: there it has no
    edit.
    """
    help = f"did you mean `{likely}`?"
    return Fix(help) if have_other_ids(name, likely) else Fix(help, likely, name)


def sort_diagnostics(diagnostics: Iterable[Diagnostic]) -> tuple[Diagnostic, ...]:
    """The diagnostics in their total order, each once."""
    unique = {(d.order, d.help): d for d in diagnostics}
    return tuple(sorted(unique.values(), key=lambda d: d.order))
