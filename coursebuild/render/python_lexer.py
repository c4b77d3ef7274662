"""Python as runs of a page's classes, in long strides.

Entry point: `python_runs(code)`.

1. The classes of a page do not tell names, operators and white space apart, so a stretch of them is
   one run here, found by one regular expression, as are keywords, numbers, comments and strings.
2. Strings with fields, and others with something in them that is marked, are read piece by piece.
3. All else (`match` and `case`, names in most scripts, what is no Python) is left to Pygments'
   rules, one at a time, from its first state until it is there again. Pygments takes longer to
   import than a script to mark, so it is imported only then.

What is shown is what Pygments' own lexer gives, for any text.
"""

from __future__ import annotations

import keyword
import re
from typing import TypeAlias

from coursebuild.patterns import pattern

Run: TypeAlias = tuple[str, str]
"""A class, or nothing, and the text that has it."""

LETTERS = "\u00c0-\u00d6\u00d8-\u00f6\u00f8-\u017f\u0391-\u03a1\u03a3-\u03c9\u0410-\u044f"
"""Letters of names, besides those of English; Pygments knows many more."""
MAGIC = frozenset(
    f"__{name}__"
    for name in (
        "abs add aenter aexit aiter and anext await bool bytes call complex contains del delattr"
        " delete delitem dir divmod enter eq exit float floordiv format ge get getattr getattribute"
        " getitem gt hash iadd iand ifloordiv ilshift imatmul imod imul index init instancecheck"
        " int invert ior ipow irshift isub iter itruediv ixor le len length_hint lshift lt matmul"
        " missing mod mul ne neg new next or pos pow prepare radd rand rdivmod repr reversed"
        " rfloordiv rlshift rmatmul rmod rmul ror round rpow rrshift rshift rsub rtruediv rxor set"
        " setattr setitem str sub subclasscheck truediv xor"
    ).split()
)
"""Names that are marked wherever they stand."""
_IN_FIELDS = frozenset("await else for if lambda True False None in is and or not".split())
"""Keywords in the fields of a string."""
_DEEPEST = 4
"""How many strings with fields may be inside of each other; Python has no more either, by far."""
_UNUSUAL = frozenset(("async", "yield"))
"""What Pygments takes together with the next word there."""

_ALONE = r"(?![\"']|[^\x00-\x7f])"
"""No part of a longer name, and not before a string."""
_WORD = rf"[A-Za-z_{LETTERS}][A-Za-z_0-9{LETTERS}]*+{_ALONE}"
_ASCII = rf"[A-Za-z_][A-Za-z_0-9]*+{_ALONE}"
_KEYWORD = rf"(?:{'|'.join(keyword.kwlist)})\b"
_NAME = rf"(?!__(?!(?:name|file)__\b)|{_KEYWORD}){_WORD}"
_DIGITS = r"\d(?:_?\d)*"
_NUMBER = (
    rf"(?:{_DIGITS}\.(?:{_DIGITS})?|(?:{_DIGITS})?\.{_DIGITS})(?:[eE][+-]?{_DIGITS})?"
    rf"|{_DIGITS}[eE][+-]?{_DIGITS}j?"
    rf"|0[oO](?:_?[0-7])+|0[bB](?:_?[01])+|0[xX](?:_?[a-fA-F0-9])+|{_DIGITS}"
)
_THREE = r"(?:\"\"\"|''')"
_OPENING = rf"(?:{_THREE}|[\"'])"
_INDENTATION = rf"[ \t]*+(?:(?=\n)|(?!\s|[rRuUbB]{{0,2}}{_THREE}|(?:case|lazy|match)\b))"
"""With nothing after it for which the start of a line matters."""
_PLAIN = rf"{_NAME}|[ \t]++|[-+*/%=<>&^|~,:;()\[\]{{}}]|!=|\.(?!\d)|@(?![A-Za-z_]|[^\x00-\x7f])"
_DOTTED = rf"{_ASCII}(?:\.{_ASCII})*+"
_IMPORTED = rf"{_DOTTED}(?:[ \t]+as[ \t]+{_ASCII})?"
_FIELD = r"\{(?![\w.]*(?:\[|(?:![sra])?:[\"'\\]))"
"""A brace after which there is nothing that Pygments may take for what ends after its string."""


def _quoted(inside: str) -> str:
    """A string on one line, with these things in it; letters by name are nowhere."""
    one, two = (
        rf"{quote}(?!{quote}{quote})(?:[^{quote}\\\n%{{]++|\\[^\nN{{%]{inside})*+{quote}"
        for quote in "'\""
    )
    return rf"(?:[uUbB]|[rR][bB]?|[bB][rR])?(?:{one}|{two})"


def _long(quote: str) -> str:
    """A string in three quotes, which may have more lines."""
    return (
        rf"{quote * 3}(?:[^{quote}\\{{]++|{quote}(?!{quote * 2})|\\[^N{{%]|{_FIELD})*+{quote * 3}"
    )


_STRIDE = pattern(
    rf"(?P<k>yield from\b|(?!(?:class|def|from|import)\b){_KEYWORD})"
    r"|(?P<c>\#[^\n]*)"
    rf"|(?P<n>{_NUMBER})"
    rf"|(?P<s>{_quoted('')})"
    rf"|(?P<plain>(?:^{_INDENTATION}|(?!^))"
    rf"(?:(?:{_PLAIN}|\\?\n{_INDENTATION})++(?:\\?\n)?|\\?\n))"
    rf"|(?P<begun>class|def)(?P<gap>[ \t]++)(?P<defined>{_WORD})"
    rf"|(?P<formatted>[fF]{_OPENING})"
    rf"|(?P<d>^[ \t]*(?P<three>{_THREE})[\s\S]*?(?P=three))"
    rf"|from[ \t]++(?:\.|(?!None\b){_ASCII})++[ \t]++(?P<imports>import)\b"
    rf"|from(?P<cause>(?=[ \t]+None\b)|[ \t]++(?!None\b){_DOTTED}(?![\w.]|\s+import\b))"
    rf"|import[ \t]++(?P<imported>{_IMPORTED}(?:[ \t]*,[ \t]*{_IMPORTED})*+)"
    r"(?=[ \t]*(?:[#;]|\Z|\n(?!\s*(?:,|as\b))))"
    rf"|(?P<a>@{_ASCII})"
    rf"|(?P<double>__{_ASCII})"
    rf"|(?P<holes>{_quoted(f'|%|{_FIELD}')}|{_long(chr(34))}|{_long(chr(39))})",
    re.MULTILINE,
)
_CLASSES = {"plain": "", **{css: css for css in "kcnsa"}}
_AS = pattern(r"([ \t]as[ \t])")
_HOLES = pattern(
    r"(?P<i>%(?:\(\w+\))?[-#0 +]*(?:[0-9]+|[*])?(?:\.(?:[0-9]+|[*]))?[hlL]?[E-GXc-giorsaux%]"
    r"|\{(?:\w+(?:\.\w+|\[[^\]]+\])*)?(?:![sra])?"
    r"(?::(?:.?[<>=\^])?[-+ ]?#?0?\d*,?(?:\.\d+)?[E-GXb-gnosx%]?)?\})"
    r"|\{\{?|%|[^{%]+"
)
"""What Pygments marks in a string that has no fields, for `%` and for `format`."""
_TEXT = {
    '"': pattern(r"(?:[^\"\\\n{}]++|\\[^\nN{}]|\{\{|\}\})++"),
    "'": pattern(r"(?:[^'\\\n{}]++|\\[^\nN{}]|\{\{|\}\})++"),
    '"""': pattern(r"(?:[^\"\\{}]++|\"(?!\"\")|\\[^N{}]|\{\{|\}\})++"),
    "'''": pattern(r"(?:[^'\\{}]++|'(?!\'\')|\\[^N{}]|\{\{|\}\})++"),
}
"""What stands between the fields of a string, by its quotes."""
_VALUE = pattern(
    rf"(?P<word>{_WORD})|(?P<n>{_NUMBER})|(?P<formatted>[fF]{_OPENING})"
    r"|(?P<s>\"(?!\"\")[^\"\\\n%{}]*+\"|'(?!\'\')[^'\\\n%{}]*+')"
    r"|(?P<open>[(\[{])|(?P<close>[)\]}])|(?P<plain>==|!=|[-+*/%<>&^|~.,;=: \t])"
)
"""One thing in a field."""
_VALUE_END = pattern(r"(?:=\s*)?(?:![sraf])?[}:]")


def python_runs(code: str) -> list[Run]:
    """All of the text, in runs of one class each; neighbours may have the same."""
    made: list[Run] = []
    at, end, match = 0, len(code), _STRIDE.match
    while at < end:
        found = match(code, at)
        if found is None:
            at = _by_rules(code, at, made)
            continue
        kind = found.lastgroup or ""
        if kind in _CLASSES:
            made.append((_CLASSES[kind], found[0]))
            at = found.end()
        elif kind == "formatted":
            at = _formatted(found, made) or _by_rules(code, at, made)
        else:
            made += _runs(kind, found)
            at = found.end()
    return made


def _by_rules(code: str, at: int, made: list[Run]) -> int:
    from coursebuild.render.python_rules import by_rules

    runs, at = by_rules(code, at)
    made += runs
    return at


def _runs(kind: str, found: re.Match[str]) -> list[Run]:
    """Of a stride with several."""
    text = found[0]
    match kind:
        case "d":
            return [("d", text)]
        case "double":
            return [("f" if text in MAGIC else "", text)]
        case "defined":
            return [("k", found["begun"]), ("", found["gap"]), ("f", found["defined"])]
        case "imports":
            return [("k", "from"), ("", text[4:-6]), ("k", "import")]
        case "cause":
            return [("k", "from"), ("", text[4:])]
        case "imported":
            parts = enumerate(_AS.split(text[6:]))
            return [("k", "import"), *(("k" if at % 2 else "", part) for at, part in parts)]
        case _:
            return [("i" if one["i"] else "s", one[0]) for one in _HOLES.finditer(text)]


def _formatted(opening: re.Match[str], made: list[Run], depth: int = 0) -> int:
    """The end of the string with fields that begins so; 0 where it has something unusual."""
    if depth > _DEEPEST:
        return 0
    code, count, at = opening.string, len(made), opening.end()
    made.append(("s", opening[0]))
    quotes = opening[0][1:]
    between = _TEXT[quotes]
    while True:
        found = between.match(code, at)
        if found is not None:
            made.append(("s", found[0]))
            at = found.end()
        if code.startswith(quotes, at):
            made.append(("s", quotes))
            return at + len(quotes)
        sign = code[at : at + 1]
        if sign in ("{", "}"):
            made.append(("i", sign))
            at = _value(code, at + 1, made, depth) if sign == "{" else at + 1
        if sign not in ("{", "}") or not at:
            del made[count:]
            return 0


def _value(code: str, at: int, made: list[Run], depth: int) -> int:
    """The end of a field's value, with the colon or the brace after it; 0 as above."""
    brackets = 0
    while True:
        if not brackets and (found := _VALUE_END.match(code, at)):
            made.append(("i", found[0]))
            return found.end()
        found = _VALUE.match(code, at)
        if found is None:
            return 0
        kind, at = found.lastgroup, found.end()
        if kind == "formatted":
            at = _formatted(found, made, depth + 1)
        elif kind == "word":
            if found[0] in _UNUSUAL:
                return 0
            css = "k" if found[0] in _IN_FIELDS else "f" if found[0] in MAGIC else ""
            made.append((css, found[0]))
        elif kind == "n" or kind == "s":
            made.append((kind, found[0]))
        else:
            brackets += (kind == "open") - (kind == "close" and brackets > 0)
            made.append(("", found[0]))
        if not at:
            return 0
