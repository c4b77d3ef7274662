"""Attributes in braces after inline content: `{term}`, `{symbol="angular velocity" unit="rad/s"}`.

Entry points: `TERM`, `SYMBOL` and `LABEL`, which find braces that may be a line below, and
`read_term`, `read_meaning` and `read_label`, which read what is in them. A value stands in quotes
where it has spaces.
"""

from __future__ import annotations

import re
from collections.abc import Callable

from coursebuild.core.model import Label, Meaning
from coursebuild.core.syntax.spans import trim
from coursebuild.core.text.diagnostics import Diagnostic, diagnose, did_you_mean
from coursebuild.core.text.source import Excerpt
from coursebuild.core.text.units import check_unit

Report = Callable[[Diagnostic], None]

TERM = re.compile(r"(\{\s*(?:term|terms|therm|tern|trem|tem|ter)\b[^{}]{0,400}\}?)", re.I)
SYMBOL = re.compile(r"(\{\s*(?:s[iy]m\w{0,6}|meaning|unit|units|given)\b[^{}]{0,400}\}?)", re.I)
LABEL = re.compile(r"[ \t]*(\{#[^{}$\n]{0,200}\}?)")
"""What belongs to a term, a symbol or a formula before it: group 1 is from `{` to behind `}`, or to
where that is missing."""
_PAIR = re.compile(r'\s*([^\s={}"]+)(?:=(?:"([^"{}]*)"|([^\s"{}]+)))?(?=\s|$)')
_ID = re.compile(r"\{#(eq:[\w-]+)(?=[\s}])")
_SPACES = re.compile(r"\s+")

_TERM_HELP = 'write `{term}`, or `{term="headword"}` where the glossary is to say it otherwise'
_SYMBOL_HELP = 'write `{symbol="what it stands for" unit="m/s"}`, of which the unit may be left out'
_LABEL_HELP = "write `{#eq:name}`, of letters, digits, `-` and `_`"
_MARK_HELP = 'write `{#eq:name check}`, or `{#eq:name given="its source"}`'


def collapse_spaces(text: str) -> str:
    """A text in one line, each run of white space a blank."""
    return _SPACES.sub(" ", text).strip()


def _read(
    braces: Excerpt, keys: tuple[str, ...], rule: str, help: str
) -> dict[str, Excerpt | None] | Diagnostic:
    """The values by key; `None` for a key alone."""
    text = braces.text
    if not text.endswith("}"):
        return diagnose(rule, braces.span(), "the braces are never closed", help=help)
    found: dict[str, Excerpt | None] = {}
    at, end = 1, len(text) - 1
    while text[at:end].strip():
        pair = _PAIR.match(text, at, end)
        if pair is None:
            rest = trim(braces.slice(at, end))
            message = f"`{collapse_spaces(rest.text)}` cannot be read"
            return diagnose(rule, rest.span(), message, help=help)
        key, span = pair[1], braces.span(*pair.span(1))
        if key not in keys:
            near = did_you_mean(key, keys) if len(keys) > 1 else ""
            return diagnose(rule, span, f"`{key}` is no key here", help=near or help)
        if key in found:
            return diagnose(rule, span, f"`{key}` is given twice", help=help)
        value = pair.lastindex or 1
        found[key] = braces.slice(*pair.span(value)) if value > 1 else None
        at = pair.end()
    return found


def read_term(braces: Excerpt, report: Report) -> str | None:
    """The name that is given to a term; empty where it is its own text, `None` for a mistake."""
    found = _read(braces, ("term",), "term-attribute", _TERM_HELP)
    if isinstance(found, Diagnostic):
        report(found)
        return None
    given = found.get("term")
    if given is not None and not given.text.strip():
        message = "the name of the term is empty"
        report(diagnose("term-attribute", braces.span(), message, help=_TERM_HELP))
        return None
    return _text(given)


def read_meaning(braces: Excerpt, report: Report) -> tuple[Meaning | None, str | None]:
    """What a symbol stands for, and where numbers are from; `None` for what is not said."""
    found = _read(braces, ("symbol", "unit", "given"), "symbol-attribute", _SYMBOL_HELP)
    if isinstance(found, Diagnostic):
        report(found)
        return None, None
    source = _text(found["given"]) if "given" in found else None
    if source is not None and len(found) == 1:
        return None, source
    meaning, unit = _text(found.get("symbol")), _text(found.get("unit"))
    if not meaning or ("unit" in found and not unit):
        missing = "unit is empty" if meaning else "meaning of the symbol is missing"
        report(diagnose("symbol-attribute", braces.span(), f"the {missing}", help=_SYMBOL_HELP))
        return None, source
    for wrong in check_unit(found["unit"]) if unit and found["unit"] is not None else ():
        report(wrong)
    return Meaning(braces.span(), meaning, unit), source


def _text(value: Excerpt | None) -> str:
    return "" if value is None else collapse_spaces(value.text)


def read_label(braces: Excerpt, report: Report) -> Label | None:
    """The label of a formula; `None` for a mistake."""
    closed = braces.text.endswith("}")
    found = _ID.match(braces.text) if closed else None
    if found is None:
        message = "the label of this formula is never closed"
        if closed:
            message = f"`{braces.text}` is no label of a formula"
        report(diagnose("equation-label", braces.span(), message, help=_LABEL_HELP))
        return None
    end = found.end()
    marks = _read(braces.slice(end - 1), ("check", "given"), "equation-label", _MARK_HELP)
    if isinstance(marks, Diagnostic):
        report(marks)
        marks = {}
    source = _text(marks["given"]) if "given" in marks else None
    check = braces.span(end, len(braces.text) - 1) if "check" in marks else None
    return Label(braces.span(2, end), found[1], source, check)
