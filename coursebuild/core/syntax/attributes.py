"""Attributes in braces after inline content: `{term}`, `{symbol="angular velocity" unit="rad/s"}`.

Entry points: `Braces.find`, `read_term`, `read_meaning`, `read_label`.

1. `Braces` says where braces begin and end, which may be a line below; it does not look inside.
2. What is in them is read against the keys that they may have. A value stands in quotes where it
   has spaces.
"""

from __future__ import annotations

import re
from collections.abc import Callable

from msgspec import Struct

from coursebuild.core.model import Label, Meaning
from coursebuild.core.text.diagnostics import Diagnostic, diagnose, did_you_mean
from coursebuild.core.text.source import Excerpt
from coursebuild.core.text.units import check_unit

Report = Callable[[Diagnostic], None]

_TERM = re.compile(r"\{\s*(?:term|terms|therm|tern|trem|tem|ter)\b[^{}]{0,400}(\}?)", re.I)
_SYMBOL = re.compile(r"\{\s*(?:s[iy]m\w{0,6}|meaning|unit|units|given)\b[^{}]{0,400}(\}?)", re.I)
_LABEL = re.compile(r"[ \t]*(\{#[^{}$\n]{0,200}\}?)")
_PAIR = re.compile(r'\s*([^\s={}"]+)(?:=(?:"([^"{}]*)"|([^\s"{}]+)))?(?=\s|$)')
_ID = re.compile(r"\{#(eq:[\w-]+)(?=[\s}])")
_SPACES = re.compile(r"\s+")

_TERM_HELP = 'write `{term}`, or `{term="headword"}` where the glossary is to say it otherwise'
_SYMBOL_HELP = 'write `{symbol="what it stands for" unit="m/s"}`, of which the unit may be left out'
_LABEL_HELP = "write `{#eq:name}`, of letters, digits, `-` and `_`"
_MARK_HELP = 'write `{#eq:name check}`, or `{#eq:name given="its source"}`'


class Braces(Struct, frozen=True):
    """A stretch of a text, from `{` to behind `}` or to where that is missing."""

    start: int
    end: int
    closed: bool

    @classmethod
    def of_term(cls, text: str, at: int, limit: int) -> Braces | None:
        """Those at an offset that make a term of what is before them, or were meant to."""
        return cls._found(_TERM.match(text, at, limit))

    @classmethod
    def of_symbol(cls, text: str, at: int, limit: int) -> Braces | None:
        """The same for the meaning of a symbol."""
        return cls._found(_SYMBOL.match(text, at, limit))

    @classmethod
    def of_label(cls, text: str, at: int, limit: int) -> Braces | None:
        """Those of a label, which blanks may precede."""
        found = _LABEL.match(text, at, limit)
        return cls(found.start(1), found.end(), found[1][-1] == "}") if found else None

    @classmethod
    def _found(cls, found: re.Match[str] | None) -> Braces | None:
        return cls(found.start(), found.end(), bool(found[1])) if found else None


def folded(text: str) -> str:
    """A text in one line, each run of white space a blank."""
    return _SPACES.sub(" ", text).strip()


def _read(
    content: Excerpt, braces: Braces, keys: tuple[str, ...], rule: str, help: str
) -> dict[str, Excerpt | None] | Diagnostic:
    """The values by key; `None` for a key alone."""
    place = content.span(braces.start, braces.end)
    if not braces.closed:
        return diagnose(rule, place, "the braces are never closed", help=help)
    text = content.text
    found: dict[str, Excerpt | None] = {}
    at, end = braces.start + 1, braces.end - 1
    while text[at:end].strip():
        pair = _PAIR.match(text, at, end)
        if pair is None:
            rest = content.span(at + len(text[at:end]) - len(text[at:end].lstrip()), end)
            return diagnose(rule, rest, f"`{folded(text[at:end])}` cannot be read", help=help)
        key, span = pair[1], content.span(pair.start(1), pair.end(1))
        if key not in keys:
            near = did_you_mean(key, keys) if len(keys) > 1 else ""
            return diagnose(rule, span, f"`{key}` is no key here", help=near or help)
        if key in found:
            return diagnose(rule, span, f"`{key}` is given twice", help=help)
        value = pair.lastindex or 1
        found[key] = content.slice(*pair.span(value)) if value > 1 else None
        at = pair.end()
    return found


def read_term(content: Excerpt, braces: Braces, report: Report) -> str | None:
    """The name that is given to a term; empty where it is its own text, `None` for a mistake."""
    found = _read(content, braces, ("term",), "term-attribute", _TERM_HELP)
    if isinstance(found, Diagnostic):
        report(found)
        return None
    given = found.get("term")
    if given is not None and not given.text.strip():
        place = content.span(braces.start, braces.end)
        report(diagnose("term-attribute", place, "the name of the term is empty", help=_TERM_HELP))
        return None
    return _text(given)


def read_meaning(
    content: Excerpt, braces: Braces, report: Report
) -> tuple[Meaning | None, str | None]:
    """What a symbol stands for, and where numbers are from; `None` for what is not said."""
    found = _read(content, braces, ("symbol", "unit", "given"), "symbol-attribute", _SYMBOL_HELP)
    place = content.span(braces.start, braces.end)
    if isinstance(found, Diagnostic):
        report(found)
        return None, None
    source = _text(found["given"]) if "given" in found else None
    if source is not None and len(found) == 1:
        return None, source
    meaning, unit = _text(found.get("symbol")), _text(found.get("unit"))
    if not meaning or ("unit" in found and not unit):
        missing = "unit is empty" if meaning else "meaning of the symbol is missing"
        report(diagnose("symbol-attribute", place, f"the {missing}", help=_SYMBOL_HELP))
        return None, source
    for wrong in check_unit(found["unit"]) if unit and found["unit"] is not None else ():
        report(wrong)
    return Meaning(place, meaning, unit), source


def _text(value: Excerpt | None) -> str:
    return "" if value is None else folded(value.text)


def read_label(content: Excerpt, braces: Braces, report: Report) -> Label | None:
    """The label of a formula; `None` for a mistake."""
    text, place = content.text[braces.start : braces.end], content.span(braces.start, braces.end)
    found = _ID.match(text) if braces.closed else None
    if found is None:
        message = "the label of this formula is never closed"
        if braces.closed:
            message = f"`{text}` is no label of a formula"
        report(diagnose("equation-label", place, message, help=_LABEL_HELP))
        return None
    end = braces.start + found.end()
    marks = _read(
        content,
        Braces(end - 1, braces.end, closed=True),
        ("check", "given"),
        "equation-label",
        _MARK_HELP,
    )
    if isinstance(marks, Diagnostic):
        report(marks)
        marks = {}
    source = _text(marks["given"]) if "given" in marks else None
    check = content.span(end, braces.end - 1) if "check" in marks else None
    return Label(content.span(braces.start + 2, end), found[1], source, check)
