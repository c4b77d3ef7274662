"""Formulas of other dialects: LaTeX's environments and brackets, dollars, labels, macros.

Entry points: `normalize_formulas`, `read_macros`, `find_macros`.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from coursebuild.api import regex
from coursebuild.features.importer.context import label_anchor
from coursebuild.features.importer.source_files import find_group, value_at

WORDS = r"\\(?:text\w*|[hm]box)\{[^{}$]*\$(?:[^{}]|\{[^{}]*\})*\}"
"""Words in a formula that hold a formula themselves."""
_DOLLAR = r"(?<!(?<!\\)\\)\$"
_NO_FORMULA = rf"(?P<kept><(?:https?|ftp):[^\s<>]*>)|(?P<dollar>{_DOLLAR})"
# A formula holds no beginning of another, so that each character is looked at a few times only.
FORMULAS = {
    "$": rf"(?P<digits>{_DOLLAR}(?P<tex>(?!\\\$)[^$\s](?:[^$\n]*[^$\s\\])?)\$"
    rf"(?P<number>\d[\d.,]*\d|\d))|(?P<math>{_DOLLAR}\$?(?>(?:{WORDS}|[^$\n])+)\$\$?)",
    "$$": rf"(?P<math>{_DOLLAR}\$(?>(?:{WORDS}|[^$\n])+)\$\$)|{_NO_FORMULA}",
    "": _NO_FORMULA,
}
"""Formulas in a line, by what begins one (see `SourceFiles.dollars`)."""
_CODE = r"(?<!(?<!\\)`)(?P<ticks>`++)(?:(?!\n[ \t]*\n).)+?(?<!`)(?P=ticks)(?!`)"
_PRICE = r"(?<!\$)\$(?=(?:[^$\\\n]|\\.|\$(?!\$))+\$\$)"
"""A dollar sign in a displayed formula, which ends in its line; MathJax shows it as it stands."""
_DISPLAY = regex(
    rf"{_CODE}|\$\$(?P<tex>(?:{WORDS}|[^$\\]|\\.|{_PRICE})+?)\$\$"
    r"(?:[ \t]*(?:\((?P<myst>[\w:.-]+)\)|\{#(?P<quarto>[\w:.-]+)\}))?"
    r"(?:[ \t]*<br[ ]*/?>)*(?P<behind>[ \t]*(?=[^\s.,;:]|[.,;:][ \t]*\S))?",
    re.DOTALL,
)
"""A formula between two dollar signs each, or code, in which there is none."""
_ENVIRONMENT = regex(
    rf"{_CODE}|\$\$(?>(?:{WORDS}|[^$])+)\$\$|(?:^[ \t]*|(?P<words>[\w,.:;)][ ]))"
    r"(?P<tex>\\begin\{(?P<env>align|aligned|alignat|cases|eqnarray|equation|flalign|gather|multline|split)(?P<star>\*?)\}"
    r"(?>(?:(?!\\(?:begin|end)\{(?P=env)(?P=star)\}).)*)"
    r"\\end\{(?P=env)(?P=star)\})(?(words)(?=\s)|[ \t]*$)",
    re.DOTALL | re.MULTILINE,
)
"""A formula between dollar signs, or one that its environment alone makes one; or code."""
_BRACKETS = regex(
    r"^(?P<lead>[ \t]*)(?:\\{1,2}\[(?P<tex>(?>(?:(?!\\{1,2}[\[\]]).)+))\\{1,2}\]"
    r"|\$(?P<lines>[ \t]*\n(?:(?!\n[ \t]*\n)[^$])+)\$)[ \t]*$",
    re.DOTALL | re.MULTILINE,
)
"""A formula between brackets, or below a line that holds nothing but a dollar sign."""
_ESCAPED = regex(
    rf"{_CODE}|(?P<mark>\\\\[(\[])(?P<tex>(?>(?:(?!\\\\[()\[\]]|\n[ \t]*\n).)+))(?=\\\\[)\]])",
    re.DOTALL,
)
"""A formula whose brackets have two backslashes, one of which is Markdown's; or code."""
_OF_MATHJAX = regex(
    rf"{_CODE}|\\(?:text\w*|[hm]box)\{{(?P<words>[^{{}}]*)\}}"
    r"|\\(?P<kind>p?matrix|cases)[ ]*\{(?P<rows>(?:[^{}]|\{(?:[^{}]|\{[^{}]*\})*\})*)\}",
    re.DOTALL,
)
"""Words in a formula, in which MathJax reads `%` as it stands, and rows in plain TeX; or code."""
LABEL = regex(r"\\label\{([^{}]*)\}[ \t]*")
_EMPTY = regex(r"[ \t]*\n?[ \t]*")
_MARGIN = regex(r"[ \t]*>[ \t>]*|[ \t]+\Z")
"""The mark of a quotation, or what a line of a list begins with."""
_LEAD = regex(r"\n[ \t>]*\Z")
"""What stands before the mark that ends a formula, on a line of its own."""
_WORDS_BEFORE = regex(r"[ \t>]*(?>(?:(?:[-+*]|\d+[.)])(?:[ \t]+|$))?)[^\s>]")
DEFINITION = regex(
    r"\\(?:(?P<kind>(?:re)?newcommand|providecommand|DeclareMathOperator)(?P<star>\*?)[ ]*"
    r"\{?\\?(?P<name>[A-Za-z]+)\}?(?:\[(?P<count>\d)\](?P<usual>\[[^\[\]]*\])?)?|"
    r"def[ ]*\\(?P<own>[A-Za-z]+)(?P<arguments>(?:#\d)*))"
    r"[ ]*\{(?P<body>(?:[^{}]|\{(?:[^{}]|\{[^{}]*\})*\})*)\}\s*"
)
"""A macro of LaTeX; MathJax takes its name without a backslash, too."""
_DOXYGEN = regex(rf"{_CODE}|\\f(?:\$(?P<inline>[^$]+?)\\f\$|\[(?P<tex>[^$]+?)\\f\])", re.DOTALL)
"""A formula of Doxygen; or code, in which there is none."""
_PLACES = (("math",), ("project", "math"), ("sphinx", "config", "mathjax3_config", "tex", "macros"))
"""Where MyST and Sphinx have macros by their names."""
_OBJECT = regex(r"\b[Mm]acros[\"']?\s*[:=]\s*\{")
_STRING = (
    r"(?P<raw>[rR]?|String\.raw)(?P<quote>\"\"\"|'''|[\"'`])"
    r"(?P<tex>(?:\\.|(?!(?P=quote))[^\\])*)(?P=quote)"
)
_ENTRY = regex(
    r"(?:[\s,]|(?:#|//)[^\n]*\n|/\*(?:(?!\*/).)*\*/)*(?:[rR](?=[\"']))?[\"']?\\*(?P<name>[A-Za-z]+)[\"']?"
    rf"\s*:\s*[\[(]?\s*{_STRING}(?:\s*,\s*\d\s*)?[\])]?",
    re.DOTALL,
)
"""A macro in an object of Python or JavaScript, where its value is literal."""
_PREAMBLE = regex(rf"\bimgmath_latex_preamble\s*=\s*{_STRING}", re.DOTALL)
_WHOLE_ENVIRONMENT = regex(r"\\begin\{(\w+\*?)\}.*?\\end\{\1\}", re.DOTALL)


def read_escapes(text: str) -> str:
    """Read Markdown's escapes in formulas, as where MathJax is given what Markdown has read."""

    def read(match: re.Match[str]) -> str:
        tex = re.sub(r"\\([!-/:-@\[-`{-~])", r"\1", match["tex"] or "")
        return f"{match['mark']}{tex}" if tex else match[0]

    return _ESCAPED.sub(read, text)


def normalize_formulas(text: str) -> str:
    """Put LaTeX formulas between dollar signs, and write labels as `{#eq:name}`."""
    text = re.sub(r"(?<!\\)\\[ \t]*(?=\n[ \t>]*\$\$)", "", text)  # a blank, at its end
    text = _OF_MATHJAX.sub(_rewrite_for_temml, text)
    text = _BRACKETS.sub(lambda m: f"{m['lead']}$${m['tex'] or m['lines']}$$", text)
    text = _DOXYGEN.sub(_write_doxygen, _DISPLAY.sub(_drop_empty, text))
    return _DISPLAY.sub(_label_formula, _ENVIRONMENT.sub(_write_environment, text))


def _rewrite_for_temml(match: re.Match[str]) -> str:
    if match["words"]:
        return re.sub(r"(?<!\\)%", r"\%", match[0])
    kind, rows = match["kind"], match["rows"]
    return f"\\begin{{{kind}}}{rows}\\end{{{kind}}}" if rows else match[0]


def _write_environment(match: re.Match[str]) -> str:
    tex, words = match["tex"], match["words"] or ""
    if words:  # a line of it could begin as that of a list
        tex = " ".join(tex.split("\n"))
    return f"{words}$${tex}$$" if tex else match[0]


def _write_doxygen(match: re.Match[str]) -> str:
    if match["tex"] or match["inline"] is None:
        return f"$${match['tex']}$$" if match["tex"] else match[0]
    inline = re.sub(r"\n(?:[ \t]*\n)+", "\n", match["inline"].strip())
    return "$" + re.sub(r"(\\(?:begin|end)\{align)\*?\}", r"\1ed}", inline) + "$"


def _drop_empty(match: re.Match[str]) -> str:
    """Return nothing for a formula of blanks, by which a text makes room below a line."""
    is_empty = match["tex"] is not None and _EMPTY.fullmatch(match["tex"])
    return (match["behind"] or "") if is_empty else match[0]


def _label_formula(match: re.Match[str]) -> str:
    if match["tex"] is None:
        return match[0]
    label = match["myst"] or match["quarto"] or find_group(LABEL, match["tex"])
    tex = LABEL.sub("", match["tex"])
    tex = re.sub(rf"({WORDS}|\\.)|\$", lambda sign: sign[1] or r"\$", tex)
    tex = re.sub(r"\n(?:[ \t]*\n)+", "\n", tex)
    if re.search(r"(?<!\\)&", _WHOLE_ENVIRONMENT.sub("", tex)):  # MyST and Sphinx align it so
        tex = f"\n\\begin{{aligned}}\n{tex.strip()}\n\\end{{aligned}}\n"
    opening, closing = "", match["behind"] or ""
    line = match.string[match.string.rfind("\n", 0, match.start()) + 1 : match.start()]
    if lead := _LEAD.search(match["tex"]):  # a mark beside a text could be that of another formula
        opening = lead[0] if _WORDS_BEFORE.match(line) else ""
        closing = lead[0] if match["behind"] is not None else ""
    if mark := _MARGIN.match(line):  # which the lines that go on may lack
        margin = "[ \t]*>" if ">" in mark[0] else mark[0]
        tex = re.sub(rf"\n(?!{margin})", f"\n{mark[0]}", tex)
    braces = f" {{#eq:{label_anchor(label)}}}" if label else ""
    return f"{opening}$${tex}$${braces}{closing}"


def read_macros(settings: Mapping[str, Any]) -> str:
    """Return the definitions of the macros that settings or front matter have."""
    header = settings.get("header-includes")
    lines = header if isinstance(header, list) else [header]
    definitions = [match[0] for line in lines for match in DEFINITION.finditer(str(line))]
    for path in _PLACES:
        macros = value_at(settings, *path)
        for name, value in macros.items() if isinstance(macros, dict) else ():
            tex = value.get("macro") if isinstance(value, dict) else value
            tex = str(tex[0] if isinstance(tex, list) and tex else tex)
            definitions.append(_define(str(name).lstrip("\\"), tex))
    return "".join(definitions)


def find_macros(program: str) -> str:
    """Return the definitions of the macros that a program in Python or JavaScript has as literals.

    They are macros of MathJax and KaTeX in an object, or LaTeX for Sphinx.
    """
    preambles = "".join(map(_literal, _PREAMBLE.finditer(program)))
    definitions = [match[0] for match in DEFINITION.finditer(preambles)]
    for start in _OBJECT.finditer(program):
        at, line = start.end(), program.rfind("\n", 0, start.start()) + 1
        if re.match(r"[ \t]*(?:#|//)", program[line : start.start()]):
            continue
        while entry := _ENTRY.match(program, at):
            at = entry.end()
            definitions.append(_define(entry["name"], _literal(entry)))
    return "".join(definitions)


def _literal(string: re.Match[str]) -> str:
    """Return the TeX of a string; a backslash that escapes nothing is one of TeX."""
    return string["tex"] if string["raw"] else re.sub(r"\\([\\\"'`])", r"\1", string["tex"])


def _define(name: str, tex: str) -> str:
    count = max(map(int, re.findall(r"#(\d)", tex)), default=0)
    arguments = "".join(f"#{number}" for number in range(1, count + 1))
    definition = f"\\def\\{name}{arguments}{{{tex}}}"
    return definition if DEFINITION.fullmatch(definition) else ""
