"""Attributes in braces after inline content: `{term}`, `{symbol="angular velocity" unit="rad/s"}`.

Entry points: `TERM`, `SYMBOL` and `LABEL`, which find braces, also on the next line; `read_term`,
`read_meaning` and `read_label`, which read them. A value with spaces stands in quotes.
"""

from __future__ import annotations

import re
from collections.abc import Callable

from coursebuild.core.model import Label, Meaning, NumberBinding
from coursebuild.core.syntax.spans import trim
from coursebuild.core.text.diagnostics import Diagnostic, diagnose, did_you_mean
from coursebuild.core.text.source import Excerpt
from coursebuild.core.text.units import check_unit

Report = Callable[[Diagnostic], None]

TERM = re.compile(r"(\{\s*(?:term|terms|therm|tern|trem|tem|ter)\b[^{}]{0,400}\}?)", re.I)
SYMBOL = re.compile(
    r"(\{\s*(?:s[iy]m\w{0,6}|meaning|unit|units|value|given)\b[^{}]{0,400}\}?)", re.I
)
LABEL = re.compile(r"[ \t]*(\{#[^{}$\n]{0,200}\}?)")
"""The attributes of a term, a symbol or a formula; group 1 is the braces, the last of which may be
missing."""
_PAIR = re.compile(r'\s*([^\s={}"]+)(?:=(?:"([^"{}]*)"|([^\s"{}]+)))?(?=\s|$)')
_ID = re.compile(r"\{#(eq:[\w-]+)(?=[\s}])")
_SPACES = re.compile(r"\s+")
_NUMBER = re.compile(r"[-−]?(?:\d+(?:\.\d+)?|\.\d+)(?:[eE][-+]?\d{1,3})?")

_TERM_HELP = 'write `{term}`, or `{term="headword"}` if the glossary should name it differently'
_SYMBOL_HELP = 'write `{symbol="what it stands for" unit="m/s"}`, of which the unit may be left out'
_VALUE_HELP = 'write `value=9.81 given="its source"`, or `value=9.81 out=examples/x.py`'
_LABEL_HELP = "write `{#eq:name}`, of letters, digits, `-` and `_`"
_MARK_HELP = 'write `{#eq:name check}`, or `{#eq:name given="its source"}`'


def collapse_spaces(text: str) -> str:
    """A text on one line, with one space for each run of white space."""
    return _SPACES.sub(" ", text).strip()


def _read_pairs(
    braces: Excerpt, keys: tuple[str, ...], rule: str, help: str
) -> dict[str, Excerpt | None] | Diagnostic:
    """The values by key, `None` for a key alone; or a diagnostic of the first mistake."""
    text = braces.text
    if not text.endswith("}"):
        return diagnose(rule, braces.span(), "the braces are never closed", help=help)
    values: dict[str, Excerpt | None] = {}
    at, end = 1, len(text) - 1
    while text[at:end].strip():
        pair = _PAIR.match(text, at, end)
        if pair is None:
            rest = trim(braces.slice(at, end))
            message = f"`{collapse_spaces(rest.text)}` cannot be read"
            return diagnose(rule, rest.span(), message, help=help)
        key, span = pair[1], braces.span(*pair.span(1))
        if key not in keys:
            suggestion = did_you_mean(key, keys) if len(keys) > 1 else ""
            return diagnose(rule, span, f"`{key}` is not a known key here", help=suggestion or help)
        if key in values:
            return diagnose(rule, span, f"`{key}` is given twice", help=help)
        group = pair.lastindex or 1
        values[key] = braces.slice(*pair.span(group)) if group > 1 else None
        at = pair.end()
    return values


def read_term(braces: Excerpt, report: Report) -> str | None:
    """The name given to a term; empty if that is the term's own text, `None` after a mistake."""
    values = _read_pairs(braces, ("term",), "term-attribute", _TERM_HELP)
    if isinstance(values, Diagnostic):
        report(values)
        return None
    name = values.get("term")
    if name is not None and not name.text.strip():
        message = "the name of the term is empty"
        report(diagnose("term-attribute", braces.span(), message, help=_TERM_HELP))
        return None
    return _value_text(name)


def read_meaning(
    braces: Excerpt, report: Report
) -> tuple[Meaning | None, str | None, NumberBinding | None]:
    """The meaning of a symbol, the source of given numbers, and its value, if they are there."""
    keys = ("symbol", "unit", "value", "given", "out")
    values = _read_pairs(braces, keys, "symbol-attribute", _SYMBOL_HELP)
    if isinstance(values, Diagnostic):
        report(values)
        return None, None, None
    source = _value_text(values["given"]) if "given" in values else None
    value = values.get("value")
    number: NumberBinding | None = None
    if value is not None and _NUMBER.fullmatch(value.text) and not {"out", "given"} <= {*values}:
        is_bound = "out" in values
        script = _value_text(values.get("out")) or None
        origin = None if is_bound else source or ""
        number = NumberBinding(braces.span(), value.text, value.span(), script, origin)
    elif "value" in values or "out" in values:
        text = "" if value is None else value.text
        reason = f"`{text}` is no value of a symbol"
        if _NUMBER.fullmatch(text):
            reason = "a value is either given or printed by a script"
        elif "value" not in values:
            reason = "`out` binds a value, and there is none"
        place = braces if value is None else value
        report(diagnose("symbol-attribute", place.span(), reason, help=_VALUE_HELP))
        return None, source, None
    if not values.keys() & {"symbol", "unit"}:
        return None, source, number
    meaning, unit = _value_text(values.get("symbol")), _value_text(values.get("unit"))
    if not meaning or ("unit" in values and not unit):
        missing = "unit is empty" if meaning else "meaning of the symbol is missing"
        report(diagnose("symbol-attribute", braces.span(), f"the {missing}", help=_SYMBOL_HELP))
        return None, source, None
    for diagnostic in check_unit(values["unit"]) if unit and values["unit"] is not None else ():
        report(diagnostic)
    return Meaning(braces.span(), meaning, unit), source, number


def _value_text(value: Excerpt | None) -> str:
    return "" if value is None else collapse_spaces(value.text)


def read_label(braces: Excerpt, report: Report) -> Label | None:
    """The label of a formula; `None` after a mistake."""
    is_closed = braces.text.endswith("}")
    match = _ID.match(braces.text) if is_closed else None
    if match is None:
        message = "the label of this formula is never closed"
        if is_closed:
            message = f"`{braces.text}` is not a label of a formula"
        report(diagnose("equation-label", braces.span(), message, help=_LABEL_HELP))
        return None
    end = match.end()
    values = _read_pairs(braces.slice(end - 1), ("check", "given"), "equation-label", _MARK_HELP)
    if isinstance(values, Diagnostic):
        report(values)
        values = {}
    source = _value_text(values["given"]) if "given" in values else None
    check = braces.span(end, len(braces.text) - 1) if "check" in values else None
    return Label(braces.span(2, end), match[1], source, check)
