"""What IMS QTI 2.1 allows, as far as items of ours go: elements, attributes, content, references.

The published schema, imsqti_v2p1.xsd, is in no package that can be installed: none on npm, PyPI or
in Debian has it. `fixtures/qti.dtd` is written after the Information Model of 2012 (chapters
"Items", "Item Variables", "Content Model", "Interactions", "Response Processing", "Modal Feedback",
"Tests", "Outcome Processing", "Expressions") and is no substitute for the schema. It knows no more
of QTI than what the tool may write: what is not here is a mistake.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Iterator

from lxml import etree

from support.fixture_cases import FIXTURES

QTI = "http://www.imsglobal.org/xsd/imsqti_v2p1"
MATHML = "http://www.w3.org/1998/Math/MathML"

FLOAT = r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d+)?|INF|-INF|NaN"

DTD = FIXTURES / "qti.dtd"


@functools.cache
def _dtd() -> etree.DTD:
    return etree.DTD(str(DTD))


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
