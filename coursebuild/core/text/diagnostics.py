"""Messages to the author: diagnostics, their notes and edits, and the `Parsed` values with them.

A message says what is wrong and where, in lower case without a full stop; `help` says how to mend
it. `coursebuild check --fix` makes the edits of a `Fix` that are safe and change the form of a text
only (`keeps_words`); all others are proposed, for a human to decide.
"""

from __future__ import annotations

import functools
import re
import unicodedata
from collections.abc import Iterable
from typing import Generic, TypeVar

from msgspec import Struct

from coursebuild.core.text.rules import RULES, Severity
from coursebuild.core.text.source import Source, Span

T_co = TypeVar("T_co", covariant=True)


class Note(Struct, frozen=True):
    """A further remark, and where it points (if anywhere)."""

    message: str
    span: Span | None = None


class Edit(Struct, frozen=True):
    """A replacement of the text of `span` by `text`."""

    span: Span
    text: str


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


_WORD = re.compile(r"(?<!\w)[-+\u2212]?\d+(?:[.,]\d+)*|[\u207a\u207b]?\w+")
"""A number with its sign, or a word; names in code are words."""


def keeps_words(edits: Iterable[Edit]) -> bool:
    """Whether edits leave each word and number of their lines as it is: they change form only.

    That is: marks and white space between them, and characters that nobody sees.
    """
    by_source: dict[Source, list[Edit]] = {}
    for edit in edits:
        by_source.setdefault(edit.span.source, []).append(edit)
    for source, changes in by_source.items():
        changes.sort(key=lambda edit: edit.span.start)
        start = source.text.rfind("\n", 0, changes[0].span.start) + 1
        end = source.text.find("\n", max(edit.span.end for edit in changes))
        old = source.text[start : None if end < 0 else end]
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
    for name in sorted(set(names) - {word}):
        difference = _difference(word.lower(), name.lower())
        if difference <= (1 if len(name) < 5 else 2) and difference < len(name):
            return name
    return None


def _difference(first: str, second: str) -> int:
    import difflib

    blocks = difflib.SequenceMatcher(None, first, second, False).get_matching_blocks()
    return max(len(first), len(second)) - sum(block.size for block in blocks)


_LETTERS = "abcdefghijklmnopqrstuvwxyz_"
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
            slips |= {head + dropped + letter + tail for dropped in (*_LETTERS, "-", "/", ".")}
            slips |= {
                head + near + tail for near in _NEARBY.get(letter, "") if tail or head[-1] != "e"
            }
    slips |= {name + letter for letter in _LETTERS if letter != "s" or name.endswith("s")}
    return frozenset(slips - {name})


def is_one_edit(word: str, name: str) -> bool:
    """Whether a letter of a name was dropped, added, mistyped or swapped with the next one.

    Endings, as of a plural, and other digits are no slips; a short name has another letter only
    where its key is beside the right one.
    """
    shorter, longer = sorted((word, name), key=len)
    if len(longer) - len(shorter) > 1 or longer in (f"{shorter}s", f"{shorter}d", f"{shorter}r"):
        return False
    if re.findall("[0-9]", word) != re.findall("[0-9]", name) or not word.isascii():
        return False
    pairs = enumerate(zip(word, name, strict=False))
    start = next((n for n, (a, b) in pairs if a != b), len(shorter))
    rest, longer_rest = shorter[start:], longer[start:]
    if len(shorter) < len(longer):
        is_doubled = word[start - 1 : start] == word[start : start + 1]
        return rest == longer_rest[1:] and (len(name) > 3 or is_doubled)
    if len(name) < 4:
        return False
    if rest[1:] == longer_rest[1:]:
        is_beside = word[start:].lower()[:1] in _NEARBY.get(name[start:].lower()[:1], ())
        return len(name) > 6 or is_beside
    return rest[1::-1] == longer_rest[:2] and rest[2:] == longer_rest[2:]


def did_you_mean(name: str, known_names: Iterable[str]) -> str:
    """The fix that writes the nearest known name, or a help that lists them if few; or nothing."""
    names = sorted(set(known_names))
    if (likely := nearest(name, names)) is not None:
        return propose(name, likely)
    return "known: " + ", ".join(f"`{n}`" for n in names) if 0 < len(names) <= 12 else ""


_IDS = re.compile(r"\d+|(?<![^\W_])[^\W\d_](?![^\W_])")


def propose(name: str, likely: str) -> Fix:
    """The fix that writes the likely name for another, if a human finds it so.

    Names that differ in numbers or single letters are of different things: there it has no
    edit.
    """
    help = f"did you mean `{likely}`?"
    if _IDS.findall(name.lower()) != _IDS.findall(likely.lower()):
        return Fix(help)
    return Fix(help, likely, name)


def sort_diagnostics(diagnostics: Iterable[Diagnostic]) -> tuple[Diagnostic, ...]:
    """The diagnostics in their total order, each once."""
    unique = {(d.order, d.help): d for d in diagnostics}
    return tuple(sorted(unique.values(), key=lambda d: d.order))
