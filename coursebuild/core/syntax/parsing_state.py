"""The state that the readers of one document share: diagnostics, anchors, footnotes, scripts."""

from __future__ import annotations

import re
from collections.abc import Callable
from itertools import islice
from typing import TypeVar

from msgspec import Struct, field

from coursebuild.core.model import (
    LABEL_KINDS,
    Block,
    Footnote,
    FootnoteRef,
    Label,
    NumberBinding,
)
from coursebuild.core.model.course import Words
from coursebuild.core.syntax.attributes import Anchors, collapse_spaces, read_pairs, value_text
from coursebuild.core.syntax.block_parser import References
from coursebuild.core.text.diagnostics import Diagnostic, Note, Parsed, diagnose, did_you_mean
from coursebuild.core.text.macros import BEFORE_ARGUMENT, COMMAND, DEFINED, expand_macros
from coursebuild.core.text.numbers import as_printed, scan_prose
from coursebuild.core.text.regex import regex
from coursebuild.core.text.source import Excerpt, Span

T = TypeVar("T")

_LABEL_ID = regex(rf"\{{#((?P<kind>{'|'.join(LABEL_KINDS)}):[\w-]+)(?=[\s}}])")

_CALLOUT_LABEL = regex(r"\{#(([A-Za-z]+):[\w-]+)\}")
_OUT = regex(r"\\out\{((?:[^\s{}]+\.py(?![^\s}]))?)([^{}]*)\}\{((?:[^{}]|\{[^{}]*\})+)\}")
"""The script, the words and the number of what is bound in a formula."""
_GAP = r"(?:\s|~|\{,\}|\\[,;:! ])*"
_DIGIT_AFTER = regex(rf"{_GAP}\d")
_LAST_SIGN = regex(rf"([\w.}}^]){_GAP}\Z")
r"""What may take only the first sign of what follows, as `\sqrt` and `x_`, or be a part of it."""


class ParsingState:
    """The state of the parser of one document."""

    def __init__(self, callouts: frozenset[str], lesson: bool, words: Words) -> None:
        self.callouts = callouts
        self.lesson = lesson
        self.words = words
        self.macros = dict(words.macros)
        self.can_bind_in_formulas = "out" not in self.macros
        self.has_decimal_comma = "," in words.decimal
        self.in_string = False
        """Whether what is read is in a string of a data text, such as JSON."""
        self.references: References = {}
        """The link definitions of the document, which its inner texts may use."""
        self.diagnostics: list[Diagnostic] = []
        self.report = self.diagnostics.append
        self.script: str | None = None
        """The path of the nearest script above."""
        self.parts: dict[str, int] = {}
        """The number of the last part of each script above, from 0."""
        self.figures: list[str] = []
        """Names of figures of scripts above that no paragraph has shown yet."""
        self.has_invalid_script = False
        """Whether the nearest script above was read as code, because of a mistake."""
        self.level = 1
        self.notes = FootnoteList(self.report)
        self.anchors = Anchors(self.report)

    def collect_diagnostics(self, read: Callable[[], T]) -> Parsed[T]:
        """Call `read`; return its value and its diagnostics, for the caller to pass on."""
        start = len(self.diagnostics)
        value = read()
        diagnostics = tuple(self.diagnostics[start:])
        del self.diagnostics[start:]
        return Parsed(value, diagnostics)

    def read_formula(self, tex: Excerpt) -> tuple[Excerpt, tuple[NumberBinding, ...]]:
        r"""A formula with what its macros stand for, and what `\out{words}{0.3}` binds in it.

        A macro `\out` that the course or a formula above defines stays that macro.
        """
        parts, numbers, end = list[Excerpt](), list[NumberBinding](), 0
        is_used = r"\out" in tex.text
        if is_used and "out" in DEFINED.findall(tex.text):
            self.can_bind_in_formulas = False
        for command in COMMAND.finditer(tex.text) if is_used and self.can_bind_in_formulas else ():
            if command[1] != "out" or command.start() < end:
                continue
            before = "".join(part.text for part in (*parts, tex.slice(end, command.start())))
            is_group = _LAST_SIGN.search(before) is not None
            use = _OUT.match(tex.text, command.start())
            if use is None or not self._is_whole_number(tex, before, use):
                continue  # no command of TeX, as typesetting tells
            parts.append(tex.slice(end, command.start()))
            end, place = use.end(), tex.span(*use.span())
            script, words, number = use[1] or None, collapse_spaces(use[2]), tex.span(*use.span(3))
            comma = self.has_decimal_comma
            numbers.append(NumberBinding(place, use[3], number, script, comma=comma, words=words))
            parts.append(tex.slice(use.start(3) - is_group, use.end(3) + is_group))
        parts = [part for part in (*parts, tex.slice(end)) if part.text] or [tex]
        return expand_macros(Excerpt.join(parts), self.macros), tuple(numbers)

    def _is_whole_number(self, tex: Excerpt, before: str, use: re.Match[str]) -> bool:
        """Whether a text is a number where it stands, and no part of one as the 1.2 of `1.2e-3`."""
        number, after, last_sign = use[3], tex.text[use.end() :], _LAST_SIGN.search(before)
        if last_sign is not None:
            is_argument = BEFORE_ARGUMENT.search(before[: last_sign.start()])  # as in `\frac12`
            if not is_argument and (last_sign[1].isdigit() or last_sign[1] == "."):
                return False
            before += "{"
        if _DIGIT_AFTER.match(after) or tex.span(*use.span(3)).text != number:
            return False  # of other text, an edit would lose the escapes
        start, end = (len(text.replace("{,}", ",")) for text in (before, before + number))
        plain_text = f"{before}{number}{after}".replace("{,}", ",")
        text = as_printed(plain_text, self.has_decimal_comma)
        digits = text[start:end].strip("+-\u2212.")  # a sign may stand before, a full stop behind
        numbers = (n for n in scan_prose(text) if start <= n.end - 1 <= end)
        return any(n.text.strip("+-\u2212.") == digits for n in numbers)

    def take_label(self, braces: Excerpt | None, kind: str) -> Label | None:
        """The label in braces, whose id nothing else may have; `None` for none, or a mistake."""
        if braces is None:
            return None
        is_closed, subject = braces.text.endswith("}"), LABEL_KINDS[kind]
        match = _LABEL_ID.match(braces.text) if is_closed else None
        help = f"write `{{#{kind}:name}}`"
        if match is None or match["kind"] != kind:
            message = f"the label of {subject} is never closed"
            if is_closed:
                message = f"`{braces.text}` is not a label of {subject}"
            self.reject_label(braces, message, f"{help}, of letters, digits, `-` and `_`")
            return None
        end, keys = match.end(), {"eq": ("check", "given"), "tab": ("given",)}.get(kind, ())
        if keys:
            help = f'write `{{#{kind}:name}}` or `{{#{kind}:name given="its source"}}`'
            help += ', and `check` or `check="x > 0"` for an identity' if kind == "eq" else ""
        values = read_pairs(braces.slice(end - 1), keys, "label-attribute", help)
        if isinstance(values, Diagnostic):
            self.report(values)
            values = {}
        source = value_text(values["given"]) if "given" in values else None
        domain = (values["check"] or braces.slice(end, end)) if "check" in values else None
        label = Label(braces.span(2, end), match[1], source, domain)
        self.anchors.take(label.id, label.span)
        return label

    def take_callout_label(self, braces: Excerpt | None) -> Label | None:
        """The label of a callout, whose prefix is of the author's choice, as in `thm:euler`."""
        if braces is None:
            return None
        match = _CALLOUT_LABEL.fullmatch(braces.text)
        if match is None or match[2] in (*LABEL_KINDS, "term"):
            message = f"`{braces.text}` is not a label of a callout"
            help = "write `{#thm:name}`, of letters, digits, `-` and `_`; "
            help += ", ".join(f"`{kind}:`" for kind in LABEL_KINDS) + " are of other things"
            self.reject_label(braces, message, help)
            return None
        label = Label(braces.span(2, 2 + len(match[1])), match[1])
        self.anchors.take(label.id, label.span)
        return label

    def reject_label(self, braces: Excerpt, message: str, help: str) -> None:
        """Report a label that cannot be read, or that stands where none may."""
        self.report(diagnose("label-attribute", braces.span(), message, help=help))


class FootnoteText(Struct):
    """A footnote as it is written."""

    label: str
    label_span: Span
    span: Span
    read: Callable[[], tuple[Block, ...]]
    """Reads its blocks. It is called after all else is read, in the order of the numbers."""
    number: int = 0
    """0 until it is referred to."""
    references: int = 0


class FootnoteList(Struct):
    """The footnotes of a document while it is read.

    Numbers follow the order of first reference; labels are the same without regard to case.
    """

    report: Callable[[Diagnostic], None]
    by_label: dict[str, FootnoteText] = field(default_factory=dict)
    by_number: list[FootnoteText] = field(default_factory=list)
    """The footnotes with a reference, in the order of their numbers."""

    def add(self, note: FootnoteText) -> None:
        """Add a footnote, or report that its label is in use."""
        first = self.by_label.setdefault(note.label.casefold(), note)
        if first is not note:
            message = f"footnote `[^{note.label}]` is defined twice"
            notes = [Note("first defined here", first.label_span)]
            self.report(diagnose("footnote-repeated", note.label_span, message, notes=notes))

    def refer(self, label: str, span: Span) -> FootnoteRef | None:
        """A reference to a footnote; `None`, with a diagnostic, if there is none of this label."""
        note = self.by_label.get(label.casefold())
        if note is None:
            labels = [f"[^{note.label}]" for note in islice(self.by_label.values(), 100)]
            message = f"footnote `[^{label}]` is not defined anywhere"
            help = did_you_mean(f"[^{label}]", labels)
            help = help or f"write it as a paragraph that begins with `[^{label}]:`"
            self.report(diagnose("footnote-undefined", span, message, help=help))
            return None
        if not note.number:
            self.by_number.append(note)
            note.number = len(self.by_number)
        note.references += 1
        return FootnoteRef(span, label, note.number, note.references)

    def finish(self) -> tuple[Footnote, ...]:
        """Read the footnotes, and warn of those without a reference."""
        # The list grows while it is read, by footnotes to which only footnotes refer.
        blocks = [note.read() for note in self.by_number]
        footnotes = tuple(
            Footnote(note.span, note.label, note.number, note.references, inner)
            for note, inner in zip(self.by_number, blocks, strict=True)
        )
        for note in [note for note in self.by_label.values() if not note.number]:
            message = f"footnote `[^{note.label}]` is never referred to"
            self.report(diagnose("footnote-unused", note.label_span, message))
            note.read()
        self.by_label.clear()  # this breaks cycles: the notes' readers refer to this list
        self.by_number.clear()
        return footnotes
