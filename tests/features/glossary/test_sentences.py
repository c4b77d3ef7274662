"""The sentence around a term, and the next one."""

from __future__ import annotations

import pytest

from coursebuild.core.model import Paragraph, Term, plain_text, walk_inlines
from coursebuild.core.syntax.document import parse_document
from coursebuild.core.text.source import Source
from coursebuild.features.glossary.terms import definition_of, runs_on


def definition(text: str) -> tuple[str, bool]:
    """Return the definition of the first term of a text, and whether it runs on."""
    document = parse_document(Source("x.md", text), frozenset(), lesson=False).value
    paragraph = document.blocks[0]
    assert isinstance(paragraph, Paragraph)
    term = next(i for i in walk_inlines(paragraph.children) if isinstance(i, Term))
    inlines = definition_of(paragraph.children, term)
    return plain_text(inlines).strip(), runs_on(inlines)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("One. A [mass]{term} is a number. Two. Three.", "A mass is a number. Two."),
        ("A [mass]{term} is.", "A mass is."),
        ("First (so.) A [mass]{term} is! Then. No.", "A mass is! Then."),
        ("So $a = 1$. The [mass]{term} is $m$. It is.", "The mass is m. It is."),
        ("So **that.** The [mass]{term} is *heavy.* It is. No.", "The mass is heavy. It is."),
        ("Noted.[^n] The [mass]{term} is.[^n] Rest.\n\n[^n]: A.", "The mass is. Rest."),
        (
            "By P. M. Wensing, e.g. here, a [mass]{term} is, cf. Eq. 2, one. So. No.",
            "By P. M. Wensing, e.g. here, a mass is, cf. Eq. 2, one. So.",
        ),
        ("About 3.5 of a [mass]{term} is 2.5 kg. So.", "About 3.5 of a mass is 2.5 kg. So."),
        ("End.\nA **[mass]{term}** is\nlong. End. No.", "A mass is long. End."),
        ("Eins. Die [Masse]{term} z. B. ist träge. Zwei.", "Die Masse z. B. ist träge. Zwei."),
        ("第一。[質量]{term}は数である。次。三。", "質量は数である。次。"),
        ("ما هذا؟ [الكتلة]{term} عدد. ثم.", "الكتلة عدد. ثم."),
        ("He said “no.” A [mass]{term} is ‘one.’ So. No.", "A mass is ‘one.’ So."),
        ("Use `x.y`. The [mass]{term} is `m.a`. Then `b`. No.", "The mass is m.a. Then b."),
        ("A [mass]{term} is. A [weight]{term} is. No.", "A mass is."),
    ],
)
def test_a_definition_is_the_sentence_of_its_term_and_the_next(text: str, expected: str) -> None:
    assert definition(text) == (expected, False)


def test_a_definition_that_ends_below_its_paragraph_runs_on() -> None:
    assert definition("First. The [mass]{term} is\n\n$$m$$") == ("The mass is", True)
    assert definition("The [mass]{term} is. It is:\n\n$$m$$") == ("The mass is. It is:", True)
