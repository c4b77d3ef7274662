"""How a response becomes points and feedback, and what differs between the kinds of questions.

Entry points: `ResponseParts`; `processing`, the response processing of an item; `response`,
`outcomes` and `feedback`, which declare and show what it is about.
"""

from __future__ import annotations

from collections.abc import Iterable

from msgspec import Struct

from coursebuild.core.pages.xml import Element, add, element

RESPONSE, _SCORE, _FEEDBACK, EXPLANATION = "RESPONSE", "SCORE", "FEEDBACK", "EXPLANATION"
"""Names of the variables, and of the feedback that everyone gets."""


class ResponseParts(Struct, frozen=True):
    """What differs between the kinds of questions."""

    response: Element
    interaction: tuple[Element, ...]
    before: tuple[Element, ...] = ()
    """What to do, between the question and its hints."""
    test: Element | None = None
    """An expression that is true for a right response; `None`: a person scores."""
    feedback: tuple[Element, ...] = ()
    """What is said to one who chose something, named by that."""


def response(cardinality: str, base: str, right: Iterable[str]) -> Element:
    """A declaration of the response, with the right one where there is one."""
    values = [element("value", {}, value) for value in right]
    made = element("responseDeclaration", _declared(RESPONSE, cardinality, base))
    add(made, element("correctResponse", {}, *values) if values else None)
    return made


def outcomes() -> tuple[Element, Element]:
    """Declarations of the points and of what is said."""
    zero = element("defaultValue", {}, element("value", {}, "0"))
    score = element("outcomeDeclaration", _declared(_SCORE, "single", "float"), zero)
    score.set("normalMaximum", "1")
    return score, element("outcomeDeclaration", _declared(_FEEDBACK, "multiple", "identifier"))


def _declared(name: str, cardinality: str, base: str) -> dict[str, str]:
    return {"identifier": name, "cardinality": cardinality, "baseType": base}


def compared() -> tuple[Element, Element]:
    """The response and the right one, which take part in a comparison."""
    given = {"identifier": RESPONSE}
    return element("variable", given), element("correct", given)


def matches() -> Element:
    """True for the right response, of any cardinality."""
    return element("match", {}, *compared())


def feedback(name: str, content: list[Element], title: str = "") -> Element:
    """What is shown where the feedback of a name is due."""
    given = {"outcomeIdentifier": _FEEDBACK, "identifier": name, "showHide": "show"}
    return element("modalFeedback", given | ({"title": title} if title else {}), *content)


def processing(parts: ResponseParts, *, explained: bool) -> Element:
    """The points, and what is said."""
    made = element("responseProcessing")
    if parts.test is not None:
        right = element("responseIf", {}, parts.test, _set(_SCORE, _value("float", "1")))
        wrong = element("responseElse", {}, _set(_SCORE, _value("float", "0")))
        add(made, element("responseCondition", {}, right, wrong))
    says = [element("variable", {"identifier": RESPONSE})] if parts.feedback else []
    says += [_value("identifier", EXPLANATION)] if explained else []
    if says:
        add(made, _set(_FEEDBACK, element("multiple", {}, *says)))
    return made


def _set(name: str, value: Element) -> Element:
    return element("setOutcomeValue", {"identifier": name}, value)


def _value(base: str, text: str) -> Element:
    return element("baseValue", {"baseType": base}, text)


def double(value: float) -> str:
    """As XML Schema writes a number, digit by digit; zero has no sign."""
    return repr(float(value) + 0.0)
