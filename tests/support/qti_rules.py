"""What IMS QTI 2.1 allows, as far as items of ours go: elements, attributes, content, references.

Entry point: `mistakes(data)`.

The published schema, imsqti_v2p1.xsd, is in no package that can be installed: none on npm, PyPI or
in Debian has it. This is written after the Information Model of 2012 (chapters "Items", "Item
Variables", "Content Model", "Interactions", "Response Processing", "Modal Feedback", "Tests",
"Outcome Processing", "Expressions") and is no substitute for the schema. It knows no more of QTI
than what the tool may write: what is not here is a mistake.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

from lxml import etree

QTI = "http://www.imsglobal.org/xsd/imsqti_v2p1"
MATHML = "http://www.w3.org/1998/Math/MathML"
XML = "{http://www.w3.org/XML/1998/namespace}"
XSI = "{http://www.w3.org/2001/XMLSchema-instance}"

NAME = r"[A-Za-z_][A-Za-z0-9_.\-]*"
FLOAT = r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d+)?|INF|-INF|NaN"
COUNT = r"\d+"
TEXT = r"(?s).*"
ADDRESS = r"[!-~]+"
BASES = "identifier|boolean|integer|float|string"

INLINE = (
    "a abbr acronym b big br cite code dfn em i img kbd math q samp small span strong sub sup tt"
    " var #"
).split()
STATIC = "address blockquote div dl h1 h2 h3 h4 h5 h6 hr math ol p pre table ul".split()
FIELDS = ["textEntryInteraction"]
BODY = {"class": TEXT, XML + "lang": r"[A-Za-z0-9-]+"}
EXPRESSION = "baseValue|correct|equal|match|multiple|stringMatch|sum|testVariables|variable"


@dataclass(frozen=True)
class Rule:
    """An element: its attributes, and a pattern of the names of its children, `#` for text."""

    required: dict[str, str]
    optional: dict[str, str]
    content: str


def _any(*names: str) -> str:
    return "(" + "|".join(f"{name} " for name in names) + ")*"


def _line(extra: list[str] | None = None) -> Rule:
    return Rule({}, BODY, _any(*INLINE, *(extra or [])))


FLOW = _any(*INLINE, *STATIC)
CELL = {"colspan": COUNT, "rowspan": COUNT, "scope": "row|col|rowgroup|colgroup"}
RULES: dict[str, Rule] = {
    **{name: _line() for name in INLINE if name not in ("#", "math", "br", "img", "a")},
    **{name: _line() for name in ("address", "h1", "h2", "h3", "h4", "h5", "h6", "caption", "dt")},
    "p": _line(FIELDS),
    "br": Rule({}, BODY, ""),
    "hr": Rule({}, BODY, ""),
    "a": Rule({"href": ADDRESS}, BODY, _any(*INLINE)),
    "img": Rule({"src": ADDRESS, "alt": TEXT}, {"height": COUNT, "width": COUNT, **BODY}, ""),
    "pre": Rule({}, BODY, _any(*(n for n in INLINE if n not in ("big", "small", "sub", "sup")))),
    "div": Rule({}, BODY, FLOW),
    "li": Rule({}, BODY, FLOW),
    "dd": Rule({}, BODY, FLOW),
    "td": Rule({}, BODY | CELL, FLOW),
    "th": Rule({}, BODY | CELL, FLOW),
    "blockquote": Rule({}, BODY, _any(*STATIC)),
    "ul": Rule({}, BODY, "(li )+"),
    "ol": Rule({}, BODY, "(li )+"),
    "dl": Rule({}, BODY, "(dt |dd )+"),
    "table": Rule({}, BODY, "(caption )?(thead )?(tfoot )?(tbody )+"),
    "thead": Rule({}, BODY, "(tr )+"),
    "tfoot": Rule({}, BODY, "(tr )+"),
    "tbody": Rule({}, BODY, "(tr )+"),
    "tr": Rule({}, BODY, "(td |th )+"),
    # items
    "assessmentItem": Rule(
        {"identifier": NAME, "title": TEXT, "adaptive": "false", "timeDependent": "false"},
        {XML + "lang": r"[A-Za-z0-9-]+", XSI + "schemaLocation": TEXT, "label": TEXT},
        "(responseDeclaration )*(outcomeDeclaration )*(stylesheet )*(itemBody )?"
        "(responseProcessing )?(modalFeedback )*",
    ),
    "responseDeclaration": Rule(
        {"identifier": NAME, "cardinality": "single|multiple|ordered", "baseType": BASES},
        {},
        "(correctResponse )?",
    ),
    "outcomeDeclaration": Rule(
        {"identifier": NAME, "cardinality": "single|multiple", "baseType": BASES},
        {"normalMaximum": FLOAT},
        "(defaultValue )?",
    ),
    "correctResponse": Rule({}, {}, "(value )+"),
    "defaultValue": Rule({}, {}, "(value )+"),
    "value": Rule({}, {}, "(# )?"),
    "stylesheet": Rule({"href": ADDRESS, "type": "text/css"}, {}, ""),
    "itemBody": Rule(
        {},
        BODY,
        _any(
            *STATIC, "choiceInteraction", "orderInteraction", "extendedTextInteraction",
            "rubricBlock", "infoControl",
        ),
    ),
    "rubricBlock": Rule({"view": "scorer"}, BODY, _any(*STATIC)),
    "infoControl": Rule({"title": TEXT}, BODY, FLOW),
    "choiceInteraction": Rule(
        {"responseIdentifier": NAME, "shuffle": "true|false", "maxChoices": COUNT},
        BODY,
        "(simpleChoice )+",
    ),
    "orderInteraction": Rule(
        {"responseIdentifier": NAME, "shuffle": "true|false"}, BODY, "(simpleChoice )+"
    ),
    "simpleChoice": Rule({"identifier": NAME}, BODY, FLOW),
    "textEntryInteraction": Rule({"responseIdentifier": NAME}, {"expectedLength": COUNT}, ""),
    "extendedTextInteraction": Rule({"responseIdentifier": NAME}, {"expectedLines": COUNT}, ""),
    "modalFeedback": Rule(
        {"outcomeIdentifier": NAME, "identifier": NAME, "showHide": "show|hide"},
        {"title": TEXT},
        FLOW,
    ),
    # processing
    "responseProcessing": Rule({}, {}, "(responseCondition |setOutcomeValue )*"),
    "responseCondition": Rule({}, {}, "responseIf (responseElse )?"),
    "responseIf": Rule({}, {}, f"({EXPRESSION}) (setOutcomeValue )*"),
    "responseElse": Rule({}, {}, "(setOutcomeValue )*"),
    "setOutcomeValue": Rule({"identifier": NAME}, {}, f"({EXPRESSION}) "),
    "match": Rule({}, {}, f"(({EXPRESSION}) ){{2}}"),
    "equal": Rule(
        {"toleranceMode": "absolute", "tolerance": f"({FLOAT}) ({FLOAT})"},
        {},
        f"(({EXPRESSION}) ){{2}}",
    ),
    "stringMatch": Rule({"caseSensitive": "true|false"}, {}, f"(({EXPRESSION}) ){{2}}"),
    "multiple": Rule({}, {}, f"(({EXPRESSION}) )*"),
    "sum": Rule({}, {}, f"(({EXPRESSION}) )+"),
    "variable": Rule({"identifier": NAME}, {}, ""),
    "correct": Rule({"identifier": NAME}, {}, ""),
    "baseValue": Rule({"baseType": BASES}, {}, "# "),
    "testVariables": Rule({"variableIdentifier": NAME}, {}, ""),
    # tests
    "assessmentTest": Rule(
        {"identifier": NAME, "title": TEXT},
        {XSI + "schemaLocation": TEXT},
        "(outcomeDeclaration )*(testPart )+(outcomeProcessing )?",
    ),
    "testPart": Rule(
        {
            "identifier": NAME,
            "navigationMode": "linear|nonlinear",
            "submissionMode": "individual|simultaneous",
        },
        {},
        "(assessmentSection )+",
    ),
    "assessmentSection": Rule(
        {"identifier": NAME, "title": TEXT, "visible": "true|false"}, {}, "(assessmentItemRef )*"
    ),
    "assessmentItemRef": Rule({"identifier": NAME, "href": ADDRESS}, {}, ""),
    "outcomeProcessing": Rule({}, {}, "(setOutcomeValue )*"),
}  # fmt: skip


def mistakes(data: bytes) -> list[str]:
    """What is wrong with an item or a test."""
    root = etree.fromstring(data)
    messages = [f"{_name(node)}: {message}" for node in root.iter() for message in _element(node)]
    return messages + list(_references(root))


def _name(node: etree._Element) -> str:
    return etree.QName(node).localname


def _element(node: etree._Element) -> Iterator[str]:
    if not isinstance(node.tag, str):
        yield "a comment or an instruction"
        return
    space = etree.QName(node).namespace
    if space == MATHML:  # which has a schema of its own
        if _name(node) == "math" and node.getparent().tag.startswith(f"{{{MATHML}}}"):
            yield "a formula in a formula"
        return
    if space != QTI or _name(node) not in RULES:
        yield f"no element of QTI: {node.tag}"
        return
    rule = RULES[_name(node)]
    yield from _attributes(node, rule)
    children = "".join(f"{name} " for name in _children(node))
    if not re.fullmatch(rule.content, children):
        yield f"does not hold {children.strip()}"


def _attributes(node: etree._Element, rule: Rule) -> Iterator[str]:
    patterns = rule.required | rule.optional
    for key, value in node.attrib.items():
        if key not in patterns:
            yield f"has no attribute {key}"
        elif not re.fullmatch(patterns[key], value):
            yield f"{key} is not {value!r}"
    yield from (f"lacks {key}" for key in rule.required if key not in node.attrib)


def _children(node: etree._Element) -> Iterator[str]:
    if (node.text or "").strip() or (node.text and not len(node)):
        yield "#"
    for child in node:
        yield _name(child)
        if (child.tail or "").strip():
            yield "#"


def _references(root: etree._Element) -> Iterator[str]:
    """Names that are declared once, and used as they are declared."""
    if _name(root) != "assessmentItem":
        names = [node.get("identifier") for node in root.iter(f"{{{QTI}}}assessmentItemRef")]
        yield from ["an item twice"] if len(set(names)) < len(names) else []
        return
    nodes_by_identifier = {
        node.get("identifier"): node
        for kind in ("responseDeclaration", "outcomeDeclaration")
        for node in root.iter(f"{{{QTI}}}{kind}")
    }
    for node in root.iter():
        for key in ("responseIdentifier", "outcomeIdentifier"):
            if node.get(key) not in (None, *nodes_by_identifier):
                yield f"{_name(node)}: {key} {node.get(key)} is declared nowhere"
        refers = _name(node) in ("variable", "correct", "setOutcomeValue")
        if refers and node.get("identifier") not in nodes_by_identifier:
            yield f"{_name(node)}: {node.get('identifier')} is declared nowhere"
    yield from _choices(root, nodes_by_identifier["RESPONSE"])


def _choices(root: etree._Element, response: etree._Element) -> Iterator[str]:
    """A right response names choices that there are, as many as its cardinality allows."""
    right = [node.text for node in response.iter(f"{{{QTI}}}value")]
    choices = [node.get("identifier") for node in root.iter(f"{{{QTI}}}simpleChoice")]
    if len(set(choices)) < len(choices):
        yield "two choices of one name"
    if response.get("baseType") == "identifier" and not set(right) <= set(choices):
        yield f"no choice {sorted(set(right) - set(choices))}"
    if response.get("cardinality") == "single" and len(right) > 1:
        yield "more than one right response"
    if response.get("baseType") == "float":
        yield from (f"{text!r} is no float" for text in right if not re.fullmatch(FLOAT, text))
    count = sum(_name(node).endswith("Interaction") for node in root.iter())
    if count != 1:
        yield f"{count} interactions"
