"""What IMS QTI 2.1 allows, as far as items of ours go: elements, attributes, content, references.

Entry point: `mistakes(data)`.

The published schema, imsqti_v2p1.xsd, is in no package that can be installed: none on npm, PyPI or
in Debian has it. This DTD is written after the Information Model of 2012 (chapters "Items", "Item
Variables", "Content Model", "Interactions", "Response Processing", "Modal Feedback", "Tests",
"Outcome Processing", "Expressions") and is no substitute for the schema. It knows no more of QTI
than what the tool may write: what is not here is a mistake.
"""

from __future__ import annotations

import functools
import io
import re
from collections.abc import Iterator

from lxml import etree

QTI = "http://www.imsglobal.org/xsd/imsqti_v2p1"
MATHML = "http://www.w3.org/1998/Math/MathML"

FLOAT = r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d+)?|INF|-INF|NaN"

PHRASES = "abbr acronym b big cite code dfn em i kbd q samp small span strong sub sup tt var"
INLINE = f"{PHRASES} a br img math"
STATIC = "address blockquote div dl h1 h2 h3 h4 h5 h6 hr ol p pre table ul"
INTERACTIONS = "choiceInteraction orderInteraction extendedTextInteraction"
EXPRESSION = "(baseValue|correct|equal|match|multiple|stringMatch|sum|testVariables|variable)"


def _choice(names: str) -> str:
    return "|".join(names.split())


LINE = f"(#PCDATA|{_choice(INLINE)})*"
FLOW = f"(#PCDATA|{_choice(INLINE)}|{_choice(STATIC)})*"
CONTENT = {
    f"{PHRASES} a address h1 h2 h3 h4 h5 h6 caption dt": LINE,
    "pre": re.sub(r"\b(big|small|sub|sup)\|", "", LINE),
    "p": LINE.replace(")", "|textEntryInteraction)"),
    "div li dd td th infoControl simpleChoice modalFeedback": FLOW,
    "blockquote rubricBlock": f"({_choice(STATIC)}|math)*",
    "itemBody": f"({_choice(f'{STATIC} {INTERACTIONS}')}|math|rubricBlock|infoControl)*",
    "ul ol": "(li)+",
    "dl": "(dt|dd)+",
    "table": "(caption?,thead?,tfoot?,tbody+)",
    "thead tfoot tbody": "(tr)+",
    "tr": "(td|th)+",
    "br hr img math stylesheet textEntryInteraction extendedTextInteraction": "EMPTY",
    "variable correct testVariables assessmentItemRef": "EMPTY",
    "value baseValue": "(#PCDATA)",
    "assessmentItem": "(responseDeclaration*,outcomeDeclaration*,stylesheet*,itemBody?,"
    "responseProcessing?,modalFeedback*)",
    "responseDeclaration": "(correctResponse?)",
    "outcomeDeclaration": "(defaultValue?)",
    "correctResponse defaultValue": "(value)+",
    "choiceInteraction orderInteraction": "(simpleChoice)+",
    "responseProcessing": "(responseCondition|setOutcomeValue)*",
    "responseCondition": "(responseIf,responseElse?)",
    "responseIf": f"({EXPRESSION},setOutcomeValue*)",
    "responseElse outcomeProcessing": "(setOutcomeValue)*",
    "setOutcomeValue": EXPRESSION,
    "match equal stringMatch": f"({EXPRESSION},{EXPRESSION})",
    "multiple": f"{EXPRESSION}*",
    "sum": f"{EXPRESSION}+",
    "assessmentTest": "(outcomeDeclaration*,testPart+,outcomeProcessing?)",
    "testPart": "(assessmentSection)+",
    "assessmentSection": "(assessmentItemRef)*",
}
BASE = "baseType (identifier|boolean|integer|float|string) #REQUIRED"
ATTRIBUTES = {
    f"{INLINE} {STATIC} caption dt dd li thead tfoot tbody tr td th": "class CDATA #IMPLIED",
    "a stylesheet assessmentItemRef": "href CDATA #REQUIRED",
    "img": "src CDATA #REQUIRED alt CDATA #REQUIRED height NMTOKEN #IMPLIED width NMTOKEN #IMPLIED",
    "td th": "colspan NMTOKEN #IMPLIED rowspan NMTOKEN #IMPLIED"
    " scope (row|col|rowgroup|colgroup) #IMPLIED",
    "math": "display (block|inline) #IMPLIED",
    "assessmentItem": "adaptive (false) #REQUIRED timeDependent (false) #REQUIRED"
    " xml:lang NMTOKEN #IMPLIED",
    "assessmentItem assessmentTest assessmentSection infoControl": "title CDATA #REQUIRED",
    "assessmentItem assessmentTest testPart assessmentSection assessmentItemRef simpleChoice"
    " responseDeclaration outcomeDeclaration": "identifier ID #REQUIRED",
    "responseDeclaration": f"cardinality (single|multiple|ordered) #REQUIRED {BASE}",
    "outcomeDeclaration": f"cardinality (single|multiple) #REQUIRED {BASE}"
    " normalMaximum NMTOKEN #IMPLIED",
    "stylesheet": "type CDATA #FIXED 'text/css'",
    "rubricBlock": "view (scorer) #REQUIRED",
    f"{INTERACTIONS} textEntryInteraction": "responseIdentifier IDREF #REQUIRED",
    "choiceInteraction orderInteraction": "shuffle (true|false) #REQUIRED",
    "choiceInteraction": "maxChoices NMTOKEN #REQUIRED",
    "textEntryInteraction": "expectedLength NMTOKEN #IMPLIED",
    "extendedTextInteraction": "expectedLines NMTOKEN #IMPLIED",
    "modalFeedback": "outcomeIdentifier IDREF #REQUIRED identifier NMTOKEN #REQUIRED"
    " showHide (show|hide) #REQUIRED title CDATA #IMPLIED",
    "setOutcomeValue variable correct": "identifier IDREF #REQUIRED",
    "equal": "toleranceMode (absolute) #REQUIRED tolerance CDATA #REQUIRED",
    "stringMatch": "caseSensitive (true|false) #REQUIRED",
    "baseValue": BASE,
    "testVariables": "variableIdentifier NMTOKEN #REQUIRED",
    "testPart": "navigationMode (linear|nonlinear) #REQUIRED"
    " submissionMode (individual|simultaneous) #REQUIRED",
    "assessmentSection": "visible (true|false) #REQUIRED",
}


@functools.cache
def _dtd() -> etree.DTD:
    declarations = [
        f"<!{kind} {name} {declaration}>"
        for kind, table in (("ELEMENT", CONTENT), ("ATTLIST", ATTRIBUTES))
        for names, declaration in table.items()
        for name in names.split()
    ]
    return etree.DTD(io.StringIO("\n".join(declarations)))


def mistakes(data: bytes) -> list[str]:
    """What is wrong with an item or a test; formulas have a DTD of their own."""
    root = etree.fromstring(data)
    for formula in list(root.iter(f"{{{MATHML}}}math")):
        formula[:], formula.text = [], None
    for node in root.iter():
        if not isinstance(node.tag, str):
            return ["a comment or an instruction"]
        name = etree.QName(node)
        if name.namespace != QTI and name.localname != "math":
            return [f"no element of QTI: {node.tag}"]
        node.tag = name.localname
    root.attrib.pop("{http://www.w3.org/2001/XMLSchema-instance}schemaLocation", None)
    etree.cleanup_namespaces(root)
    dtd = _dtd()
    dtd.validate(root)
    return [error.message for error in dtd.error_log] + list(_check_responses(root))


def _check_responses(root: etree._Element) -> Iterator[str]:
    """A right response names choices that there are, as many as its cardinality allows."""
    for response in root.iter("responseDeclaration"):
        right = [node.text or "" for node in response.iter("value")]
        choices = {node.get("identifier") for node in root.iter("simpleChoice")}
        if response.get("baseType") == "identifier" and not set(right) <= choices:
            yield f"no choice {sorted(set(right) - choices)}"
        if response.get("cardinality") == "single" and len(right) > 1:
            yield "more than one right response"
        if response.get("baseType") == "float":
            yield from (f"{text!r} is no float" for text in right if not re.fullmatch(FLOAT, text))
        count = sum(str(node.tag).endswith("Interaction") for node in root.iter())
        if count != 1:
            yield f"{count} interactions"
