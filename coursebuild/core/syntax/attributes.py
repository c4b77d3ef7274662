"""Attributes in braces after inline content and headings, and the anchors of a document."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterator
from unicodedata import normalize

from msgspec import Struct, field

from coursebuild.core.model import (
    Image,
    Inline,
    Meaning,
    NumberBinding,
    SourceMark,
    plain_text,
    walk_inlines,
)
from coursebuild.core.syntax.spans import trim
from coursebuild.core.text.diagnostics import (
    Diagnostic,
    Fix,
    Note,
    Parsed,
    diagnose,
    did_you_mean,
)
from coursebuild.core.text.quantities import plain_unit, read_unit
from coursebuild.core.text.regex import regex
from coursebuild.core.text.source import Excerpt, Span
from coursebuild.core.text.units import check_unit

TERM = regex(r"(\{\s*term\b[^{}]{0,400}\}?)")
SYMBOL = regex(r"(\{\s*(?:symbol|unit|value|given|out)\b[^{}]{0,400}\}?)")
LABEL = regex(r"[ \t]*(\{#[^{}$\n]{0,200}\}?)")
"""The attributes of a term, a symbol or a formula; group 1 is the braces, the last of which may be
missing."""
_GIVEN = regex(r'(?:^|(?<=\s))\{given="([^{}"]*\S[^{}"]*)"\}$')
_LAST_LABEL = regex(r"(?:^|(?<=\s))\{#[^{}$\n]{0,200}\}?$")
_PAIR = regex(r"""\s*([^\s={}"]+)(?:=(?:"([^"{}]*)"|((?![“”„‟‘’‚‛«»'`])[^\s"{}]+)))?(?=\s|$)""")
_SPACES = regex(r"\s+")
_NUMBER = regex(r"[-−]?(?:\d+(?:\.\d+)?|\.\d+)(?:[eE][-+]?\d{1,3})?")
_RESULT = regex(rf"(?s:.*)(?:[=≈]|\\approx)\s*({_NUMBER.pattern})(?!\{{?[,\d])((?s:.*))\Z")
_WITH_COMMA = regex(_RESULT.pattern.replace(r"\.", r"(?:,|\{,\})"))
"""A formula that ends with a number, and what stands behind it."""

_TERM_HELP = 'write `{term}`, or `{term="headword"}` if the glossary should name it differently'
_SYMBOL_HELP = 'write `{symbol="what it stands for" unit="m/s"}`, of which the unit may be left out'
_VALUE_HELP = (
    "write `value=9.81`, or `value=9.81 out=examples/x.py` for what a script prints; without "
    "`value`, `out` is of the number that ends the formula"
)
NO_SOURCE = "`given` names no source here"
SOURCE_HELP = (
    'name it, as in `{given="models/pendulum.xml"}`; a number that is chosen needs no mark, so '
    "delete this one and the backticks before it"
)


def collapse_spaces(text: str) -> str:
    """A text on one line, with one space for each run of white space."""
    return _SPACES.sub(" ", text).strip()


def read_pairs(
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
            suggestion = (did_you_mean(key, keys) if len(keys) > 1 else "") or help
            return diagnose(rule, span, f"`{key}` is not a known key here", help=suggestion)
        if key in values:
            return diagnose(rule, span, f"`{key}` is given twice", help=help)
        group = pair.lastindex or 1
        values[key] = braces.slice(*pair.span(group)) if group > 1 else None
        if key == "given" and not value_text(values[key]):
            return diagnose(rule, span, NO_SOURCE, help=SOURCE_HELP)
        at = pair.end()
    return values


def read_term(braces: Excerpt, report: Callable[[Diagnostic], None]) -> str | None:
    """The name given to a term; empty if that is the term's own text, `None` after a mistake."""
    values = read_pairs(braces, ("term",), "term-attribute", _TERM_HELP)
    if not isinstance(values, Diagnostic):
        name = values.get("term")
        if name is None or name.text.strip():
            return value_text(name)
        message = "the name of the term is empty"
        values = diagnose("term-attribute", braces.span(), message, help=_TERM_HELP)
    report(values)
    return None


def read_meaning(
    braces: Excerpt,
    tex: Excerpt,
    numbers: Collection[NumberBinding],
    report: Callable[[Diagnostic], None],
    *,
    comma: bool = False,
) -> tuple[Meaning | None, str | None, NumberBinding | None]:
    """The meaning of a symbol, the source of given numbers, and its value, if they are there.

    `out` alone is of the value that stands in the formula, with a comma before its decimals where
    the language of the text has one; `numbers` are bound in it already.
    """
    keys = ("symbol", "unit", "value", "given", "out")
    values = read_pairs(braces, keys, "symbol-attribute", _SYMBOL_HELP)
    if isinstance(values, Diagnostic):
        report(values)
        return None, None, None
    source = value_text(values["given"]) if "given" in values else None
    value, number, unit = values.get("value"), None, value_text(values.get("unit"))
    result = None
    if "out" in values and value is None:
        result = _RESULT.match(tex.text) or (_WITH_COMMA.match(tex.text) if comma else None)
    if result is not None and (not result[2].strip() or read_unit(result[2])):
        number_text = tex.slice(*result.span(1))
        is_bound = any(n.text_span.contains(number_text.span()) for n in numbers)
        if number_text.span().text == number_text.text and not is_bound:  # nor in a macro
            value, unit = number_text, plain_unit(result[2]) or unit
    is_number = value is not None and (result or _NUMBER.fullmatch(value.text)) is not None
    if value is not None and is_number and not {"out", "given"} <= {*values}:
        printed = values.get("out")
        origin_text = value_text(printed)
        is_quoted = printed is not None and printed.source.text[printed.span().start - 1] == '"'
        script, words = (None, origin_text) if is_quoted else (origin_text or None, "")
        origin = None if "out" in values else source or ""
        number = NumberBinding(
            braces.span(), value.text, value.span(), script, origin, unit, comma, words
        )
    elif value is not None or "out" in values:
        message = "this says no value that is either given or printed by a script"
        report(diagnose("symbol-attribute", (value or braces).span(), message, help=_VALUE_HELP))
        return None, source, None
    if not values.keys() & {"symbol", "unit"}:
        return None, source, number
    meaning, unit = value_text(values.get("symbol")), value_text(values.get("unit"))
    if not meaning or ("unit" in values and not unit):
        missing = "unit is empty" if meaning else "meaning of the symbol is missing"
        report(diagnose("symbol-attribute", braces.span(), f"the {missing}", help=_SYMBOL_HELP))
        return None, source, None
    for diagnostic in check_unit(values["unit"]) if unit and values["unit"] is not None else ():
        report(diagnostic)
    return Meaning(braces.span(), meaning, unit), source, number


def value_text(value: Excerpt | None) -> str:
    """The text of a value on one line; empty for none."""
    return "" if value is None else collapse_spaces(value.text)


_UNREAD = regex(
    r"(?<!\\)\{\s*(?P<given>given)\b[^{}`\n]*\}?"
    r"|(?<=`)(?<!\\`)\{\s*(?P<binding>out|code)\b[^{}`\n]*\}?"
    r"|(?<=\$)(?<!\\\$)\{\s*(?P<symbol>symbol|unit|value|out)\b[^{}\n]*\}?"
    r"|(?<=\])(?<!\\\])\{\s*(?P<term>term)\b[^{}\n]*\}?"
    r"|(?<=\$\$|\$ )\{(?P<label>eq):[\w-]+\}"
)
"""Braces that begin as an attribute does: after code, a formula, a bracket, or for a source
anywhere."""
_BINDING_HELP = (
    'write `{out}`, `{out="words before it"}`, `{out=examples/x.py}` or `{code}`; write `\\{` for '
    "a brace that readers should see"
)
_GIVEN_HELP = (
    'write `{given="its source"}` behind a number in backticks, a formula or a paragraph, or alone '
    "below a paragraph, a list or a table, after an empty line; write `\\{` for a brace that "
    "readers should see"
)
_FORMULA_HELP = (
    "bind a number in backticks, as in `` `4.9 m`{out} ``, or a value: `{value=4.9 out}`"
)
_HELPS = {
    "binding": _BINDING_HELP,
    "given": _GIVEN_HELP,
    "symbol": _SYMBOL_HELP,
    "term": _TERM_HELP,
    "label": "a label begins with `#`: write `{#eq:name}`",
}


def check_unread_attributes(content: Excerpt, start: int, text: str) -> Iterator[Diagnostic]:
    """Report the attributes that begin in a text of a block's content: what is read is no text."""
    whole, end = content.text, start + len(text)
    braces = re.finditer(r"\{", whole[start:end])
    for match in filter(None, (_UNREAD.match(whole, start + b.start()) for b in braces)):
        kind = match.lastgroup or ""
        message, help = f"`{collapse_spaces(match[0])}` cannot be read", _HELPS[kind]
        if re.fullmatch(r'\{given(?:="\s*")?\}', match[0]):
            message, help = NO_SOURCE, SOURCE_HELP
        elif match["symbol"] == "out":
            message, help = f"`{match[0]}` binds no formula", _FORMULA_HELP
        place, rule = content.span(*match.span()), "binding" if kind == "given" else kind
        yield diagnose(f"{rule}-attribute", place, message, help=help)


def split_source_mark(text: Excerpt) -> tuple[Excerpt, SourceMark | None]:
    """The content of a paragraph, and the source of its numbers at its end, if there is one."""
    match = _GIVEN.search(text.text) if text.text.endswith("}") else None
    if match is None:
        return text, None
    mark = SourceMark(text.span(*match.span()), collapse_spaces(match[1]))
    return trim(text.slice(0, match.start())), mark


def split_label(text: Excerpt) -> tuple[Excerpt, Excerpt | None]:
    """A caption or an info string, and the label in braces at its end, if there is one."""
    match = _LAST_LABEL.search(text.text) if "{#" in text.text else None
    if match is None:
        return text, None
    return trim(text.slice(0, match.start())), text.slice(match.start())


_CANDIDATE = regex(r"(?:^|(?<=[ \t]))\{[ \t]*[#.][^{}]*(\}?)[ \t]*$")
_WHOLE_ID = regex(r"#[\w:.-]*[\w:-]|#\w")
_WORD = regex(r"\S+")
_CLASS = regex(r"\.[A-Za-z_][\w-]*")
_NO_SLUG = regex(r"[^\w\s-]")
_SPACE = regex(r"\s")
_HELP = (
    "write `{#id}`, `{.class}` or `{#id .class}`, "
    "of letters, digits, `-` and `_`, and in an id also `:` and `.`"
)


class Attributes(Struct, frozen=True):
    """The attributes in braces after a heading, and the heading's text before them."""

    title: Excerpt
    id: Excerpt | None = None
    """With its `#`."""
    classes: tuple[str, ...] = ()


def read_attributes(content: Excerpt) -> Parsed[Attributes]:
    """Split a heading's content into its text and its attributes."""
    match = _CANDIDATE.search(content.text) if "{" in content.text else None
    if match is None:
        return Parsed(Attributes(content))
    title, braces = trim(content.slice(0, match.start())), trim(content.slice(match.start()))
    if not match[1]:
        fix = Fix(_HELP, braces.text + "}", safe=True)
        return _reject(title, braces, "the attributes of this heading are never closed", fix)
    name, classes, inner = None, list[str](), braces.slice(1, len(braces.text) - 1)
    for word in (inner.slice(*match.span()) for match in _WORD.finditer(inner.text)):
        if _WHOLE_ID.fullmatch(word.text) and name is None:
            name = word
        elif _CLASS.fullmatch(word.text):
            classes.append(word.text[1:])
        elif word.text.startswith("#") and name is not None:
            return _reject(title, word, "a heading has one id")
        else:
            return _reject(title, word, f"`{word.text}` is neither an id nor a class")
    return Parsed(Attributes(title, name, tuple(classes)))


def _reject(title: Excerpt, place: Excerpt, message: str, help: str = _HELP) -> Parsed[Attributes]:
    diagnostic = diagnose("heading-attributes", place.span(), message, help=help)
    return Parsed(Attributes(title), (diagnostic,))


def slug(text: str, default: str = "section") -> str:
    """The anchor of a text: letters and digits of any script in lower case, hyphens for spaces."""
    return _SPACE.sub("-", _NO_SLUG.sub("", text.strip().lower())).strip("-") or default


def term_id(name: str) -> str:
    """The id of a term in links; empty for a name without letters and digits."""
    return slug(normalize("NFC", name), "")


class Anchors(Struct):
    """The anchors of a document. Explicit ids are known before the first heading is named."""

    report: Callable[[Diagnostic], None]
    explicit: dict[str, Span | None] = field(default_factory=dict)
    """Each explicit id, with the span of the heading or formula that uses it, once it was read."""
    generated: set[str] = field(default_factory=set)
    counts: dict[str, int] = field(default_factory=dict)
    """The last number given to ids made of the same text."""

    def reserve(self, name: str) -> None:
        """Keep an id for the heading that asks for it."""
        self.explicit.setdefault(name, None)

    def take(self, name: str, span: Span) -> None:
        """Use an explicit id."""
        first = self.explicit.get(name)
        if first is None and name not in self.generated:
            self.explicit[name] = span
            return
        message = f"the id `{name}` is already used"
        notes = [Note("first used here", first)] if first is not None else []
        self.report(diagnose("anchor-repeated", span, message, notes=notes))

    def has(self, name: str) -> bool:
        """Whether a heading or a formula has an id, or asks for it."""
        return name in self.explicit or name in self.generated

    def make(self, text: str) -> str:
        """The anchor of a heading without an id."""
        base = name = slug(text)
        count = self.counts.get(base, 1)
        while self.has(name):
            count += 1
            name = f"{base}-{count}"
        self.counts[base] = count
        self.generated.add(name)
        return name


def check_heading(
    span: Span, level: int, previous: int | None, children: tuple[Inline, ...], *, lesson: bool
) -> Iterator[Diagnostic]:
    """Check a heading; `previous` is the level of the heading before it, if it must fit to that."""
    if not plain_text(children).strip() and not any(
        isinstance(inline, Image) for inline in walk_inlines(children)
    ):
        yield diagnose("heading-empty", span, "the heading has no text")
    if level == 1:
        help = "the title comes from the course map; begin with `## `"
        message = "a lesson cannot have a heading of level 1"
        if not lesson:
            message = "a page can have no heading of level 1 but its title, at its top"
        yield diagnose("heading-top", span, message, help=help)
    if previous is not None and level > previous + 1:
        message = f"a heading of level {level} follows one of level {previous}"
        if lesson and previous == 1:
            message = f"a heading of level {level} comes before any of level 2"
        yield diagnose(
            "heading-skip", span, message, help=f"begin it with `{'#' * (previous + 1)} `"
        )
