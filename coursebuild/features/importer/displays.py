"""Displayed formulas of other dialects: LaTeX's environments and brackets, dollars, labels.

Entry point: `normalize_formulas`.
"""

from __future__ import annotations

import re

from coursebuild.features.importer.context import formula_anchor

_DISPLAY = re.compile(
    r"(?P<ticks>`+)(?!`)(?:(?!\n[ \t]*\n).)+?(?<!`)(?P=ticks)(?!`)"
    r"|\$\$(?P<tex>(?:[^$\\]|\\.)+?)\$\$"
    r"(?:[ \t]*(?:\((?P<myst>[\w:.-]+)\)|\{#(?P<quarto>[\w:.-]+)\}))?"
    r"(?:[ \t]*<br[ ]*/?>)*(?P<behind>[ \t]*(?=[^\s.,;:]|[.,;:][ \t]*\S))?",
    re.DOTALL,
)
"""A formula between two dollar signs each, or code, in which there is none."""
_ENVIRONMENT = re.compile(
    r"\$\$(?>[^$]+)\$\$|^[ \t]*"
    r"(?P<tex>\\begin\{(?P<env>align|aligned|alignat|eqnarray|equation|flalign|gather|multline|split)(?P<star>\*?)\}"
    r"(?>(?:(?!\\(?:begin|end)\{(?P=env)(?P=star)\}).)*)"
    r"\\end\{(?P=env)(?P=star)\})[ \t]*$",
    re.DOTALL | re.MULTILINE,
)
"""A formula between dollar signs, or one that its environment alone makes one."""
_BRACKETS = re.compile(
    r"^(?P<lead>[ \t]*)(?:\\{1,2}\[(?P<tex>(?>(?:(?!\\{1,2}[\[\]]).)+))\\{1,2}\]"
    r"|\$(?P<lines>[ \t]*\n(?:(?!\n[ \t]*\n)[^$])+)\$)[ \t]*$",
    re.DOTALL | re.MULTILINE,
)
"""A formula between brackets, or below a line that holds nothing but a dollar sign."""
_LABEL = re.compile(r"\\label\{([^{}]*)\}")
_LEAD = re.compile(r"\n[ \t>]*\Z")
"""What stands before the mark that ends a formula, on a line of its own."""
_WORDS_BEFORE = re.compile(r"[ \t>]*(?>(?:(?:[-+*]|\d+[.)])(?:[ \t]+|$))?)[^\s>]")
_WHOLE_ENVIRONMENT = re.compile(r"\\begin\{(\w+\*?)\}.*?\\end\{\1\}", re.DOTALL)


def normalize_formulas(text: str) -> str:
    """Put LaTeX formulas between dollar signs, and write labels as `{#eq:name}`."""
    text = _BRACKETS.sub(lambda m: f"{m['lead']}$${m['tex'] or m['lines']}$$", text)
    text = _ENVIRONMENT.sub(lambda m: f"$${m['tex']}$$" if m["tex"] else m[0], text)
    return _DISPLAY.sub(_label_formula, text)


def display_formula(tex: str, label: str) -> str:
    """Return a displayed formula in Markdown."""
    return f"$$\n{tex.strip()}\n$$" + (f" {{#eq:{formula_anchor(label)}}}" if label else "")


def _label_formula(match: re.Match[str]) -> str:
    if match["tex"] is None:
        return match[0]
    inside = _LABEL.search(match["tex"])
    label = match["myst"] or match["quarto"] or (inside[1] if inside else "")
    tex = _LABEL.sub("", match["tex"])
    tex = re.sub(r"\n(?:[ \t]*\n)+", "\n", tex)
    bare = _WHOLE_ENVIRONMENT.sub("", tex)
    if re.search(r"(?<!\\)&", bare):  # MyST aligns at `&`, and needs no environment
        tex = f"\n\\begin{{aligned}}\n{tex.strip()}\n\\end{{aligned}}\n"
    opening, closing = "", match["behind"] or ""
    if lead := _LEAD.search(match["tex"]):  # a mark beside a text could be that of another formula
        line = match.string[match.string.rfind("\n", 0, match.start()) + 1 : match.start()]
        opening = lead[0] if _WORDS_BEFORE.match(line) else ""
        closing = lead[0] if match["behind"] is not None else ""
    braces = f" {{#eq:{formula_anchor(label)}}}" if label else ""
    return f"{opening}$${tex}$${braces}{closing}"
