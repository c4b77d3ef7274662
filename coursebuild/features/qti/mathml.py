"""Formulas as the MathML 2.0 that QTI 2.1 holds.

Entry point: `mathml(node)`, from the tree of a drawn formula.

Pages hold MathML Core with classes and styles of the site. Elements and attributes that MathML 2.0
does not have are left out, and their content stays.
"""

from __future__ import annotations

import re

from coursebuild.core.pages.html_tree import HtmlElement
from coursebuild.core.pages.xml import Element, add, element

_TOKEN = "mathvariant mathsize mathcolor mathbackground"
_SCRIPT = "subscriptshift superscriptshift"
_ATTRIBUTES = {
    "math": "display",
    "mi": _TOKEN,
    "mn": _TOKEN,
    "mo": f"{_TOKEN} form fence separator lspace rspace stretchy symmetric maxsize minsize"
    " largeop movablelimits accent",
    "mtext": _TOKEN,
    "ms": f"{_TOKEN} lquote rquote",
    "mspace": f"{_TOKEN} width height depth linebreak",
    "mrow": "",
    "mfrac": "linethickness numalign denomalign bevelled",
    "msqrt": "",
    "mroot": "",
    "mstyle": f"scriptlevel displaystyle scriptsizemultiplier scriptminsize background {_TOKEN}",
    "merror": "",
    "mpadded": "width height depth lspace",
    "mphantom": "",
    "menclose": "notation",
    "msub": "subscriptshift",
    "msup": "superscriptshift",
    "msubsup": _SCRIPT,
    "munder": "accentunder",
    "mover": "accent",
    "munderover": "accent accentunder",
    "mmultiscripts": _SCRIPT,
    "mprescripts": "",
    "none": "",
    "mtable": "align rowalign columnalign columnwidth width rowspacing columnspacing rowlines"
    " columnlines frame framespacing equalrows equalcolumns displaystyle side minlabelspacing",
    "mtr": "rowalign columnalign",
    "mtd": "rowspan columnspan rowalign columnalign",
}
_ALIGNMENTS = {"tml-left": "left", "tml-right": "right"}
"""Classes of columns that the site's style sheet aligns."""
_EMPTY = frozenset({"mspace", "mprescripts", "none"})
_WORDS = frozenset({"mi", "mn", "mo", "mtext", "ms"})
_COLOUR = re.compile(r"(?:^|;)\s*color\s*:\s*(#[0-9a-fA-F]{3,6}|[a-zA-Z]+)\s*(?:;|$)")
_LENGTH = re.compile(r"[+-]?\d*\.?\d+(?:%|em|ex|px|in|cm|mm|pt|pc)?|\w+mathspace")


def mathml(node: HtmlElement) -> Element:
    """Convert a formula; its elements have the prefix `m`."""
    return _convert_as(node, "math")


def _convert(node: HtmlElement) -> Element:
    name = node.name if node.name in _ATTRIBUTES and node.name != "math" else "mrow"
    formula = _convert_as(node, name)
    if "border:" in node.attributes.get("style", ""):
        return element("m:menclose", {"notation": "box"}, formula)
    return formula


def _convert_as(node: HtmlElement, name: str) -> Element:
    """Make an element of this name with the attributes and the content of a node."""
    formula = element(f"m:{name}", _attributes(node, name))
    for child in node.children:
        if isinstance(child, str):
            if name in _WORDS:
                add(formula, child)
        elif child.name == "annotation" or name in _EMPTY:
            continue
        elif child.name == "semantics":
            parts = (c for c in child.elements if not c.name.startswith("annotation"))
            add(formula, *map(_convert, parts))
        elif name not in _WORDS:
            add(formula, _convert(child))
        else:
            add(formula, child.text)
    return formula


def _attributes(node: HtmlElement, name: str) -> dict[str, str]:
    """Return the attributes of a node that MathML 2.0 has for an element of this name."""
    names = _ATTRIBUTES[name].split()
    attributes = {key: value for key, value in node.attributes.items() if key in names}
    if name == "mtd":
        for mark in sorted(node.classes & _ALIGNMENTS.keys()):
            attributes["columnalign"] = _ALIGNMENTS[mark]
    colour = _COLOUR.search(node.attributes.get("style", ""))
    if colour is not None and "mathcolor" in names:
        attributes["mathcolor"] = colour[1]
    for key in ("width", "height", "depth", "lspace", "rspace"):
        if key in attributes and not _LENGTH.fullmatch(attributes[key]):
            del attributes[key]
    return dict(sorted(attributes.items()))
