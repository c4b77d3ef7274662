"""Formulas as the MathML 2.0 that QTI 2.1 holds.

Entry point: `mathml(node)`, from the tree of a drawn formula.

What browsers draw from is MathML Core with classes and styles of the site. What MathML 2.0 has no
name for is left out where it only says how something looks, and its content stays.
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
_ALIGNED = {"tml-left": "left", "tml-right": "right"}
"""Columns that the site's style sheet aligns."""
_EMPTY = frozenset({"mspace", "mprescripts", "none"})
_WORDS = frozenset({"mi", "mn", "mo", "mtext", "ms"})
_COLOUR = re.compile(r"(?:^|;)\s*color\s*:\s*(#[0-9a-fA-F]{3,6}|[a-zA-Z]+)\s*(?:;|$)")
_LENGTH = re.compile(r"[+-]?\d*\.?\d+(?:%|em|ex|px|in|cm|mm|pt|pc)?|\w+mathspace")


def mathml(node: HtmlElement) -> Element:
    """A formula, with the prefix `m`."""
    made = element("m:math", _kept(node, "math"))
    _fill(made, node, "math")
    return made


def _made(node: HtmlElement) -> Element:
    name = node.name if node.name in _ATTRIBUTES and node.name != "math" else "mrow"
    made = element(f"m:{name}", _kept(node, name))
    _fill(made, node, name)
    if "border:" in node.attributes.get("style", ""):
        return element("m:menclose", {"notation": "box"}, made)
    return made


def _fill(made: Element, node: HtmlElement, name: str) -> None:
    for child in node.children:
        if isinstance(child, str):
            if name in _WORDS:
                add(made, child)
        elif child.name == "annotation" or name in _EMPTY:
            continue
        elif child.name == "semantics":
            add(made, *(_made(c) for c in child.elements if not c.name.startswith("annotation")))
        elif name not in _WORDS:
            add(made, _made(child))
        else:
            add(made, child.text)


def _kept(node: HtmlElement, name: str) -> dict[str, str]:
    allowed = _ATTRIBUTES[name].split()
    kept = {key: value for key, value in node.attributes.items() if key in allowed}
    if name == "mtd":
        for mark in sorted(node.classes & _ALIGNED.keys()):
            kept["columnalign"] = _ALIGNED[mark]
    colour = _COLOUR.search(node.attributes.get("style", ""))
    if colour is not None and "mathcolor" in allowed:
        kept["mathcolor"] = colour[1]
    for key in ("width", "height", "depth", "lspace", "rspace"):
        if key in kept and not _LENGTH.fullmatch(kept[key]):
            del kept[key]
    return dict(sorted(kept.items()))
