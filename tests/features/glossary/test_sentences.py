"""The sentence around a term."""

from __future__ import annotations

import pytest

from coursebuild.core.model import Paragraph, Term, plain_text, walk_inlines
from coursebuild.core.syntax.document import parse_document
from coursebuild.core.text.source import Source
from coursebuild.features.glossary.sentences import runs_on, sentence_of


def sentence(text: str) -> tuple[str, bool]:
    """The sentence of the first term of a text, and whether it runs on."""
    document = parse_document(Source("x.md", text), frozenset(), lesson=False).value
    paragraph = document.blocks[0]
    assert isinstance(paragraph, Paragraph)
    term = next(i for i in walk_inlines(paragraph.children) if isinstance(i, Term))
    found = sentence_of(paragraph.children, term)
    return plain_text(found).strip(), runs_on(found)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("One. A [mass]{term} is a number. Three.", "A mass is a number."),
        ("A [mass]{term} is.", "A mass is."),
        ("First (so.) A [mass]{term} is! Then.", "A mass is!"),
        ("So $a = 1$. The [mass]{term} is $m$. It is.", "The mass is m."),
        ("So **that.** The [mass]{term} is *heavy.* It is.", "The mass is heavy."),
        ("Noted.[^n] The [mass]{term} is.[^n] Rest.\n\n[^n]: A.", "The mass is."),
        ("By P. M. Wensing, e.g. here, a [mass]{term} is, cf. Eq. 2, one. No.", None),
        ("About 3.5 of a [mass]{term} is 2.5 kg. So.", "About 3.5 of a mass is 2.5 kg."),
        ("End.\nA **[mass]{term}** is\nlong. End.", "A mass is long."),
        ("Eins. Die [Masse]{term} z. B. ist träge. Zwei.", None),
        ("第一。[質量]{term}は数である。次。", "質量は数である。"),
        ("ما هذا؟ [الكتلة]{term} عدد. ثم.", "الكتلة عدد."),
        ("He said “no.” A [mass]{term} is ‘one.’ So.", "A mass is ‘one.’"),
        ("Use `x.y`. The [mass]{term} is `m.a`. Then.", "The mass is m.a."),
    ],
)
def test_where_a_sentence_begins_and_ends(text: str, expected: str | None) -> None:
    found, on = sentence(text)
    whole = text.split(". No.")[0].split(". Zwei.")[0].removeprefix("Eins. ")
    assert found == (expected or whole.replace("[", "").replace("]{term}", "") + ".")
    assert not on


def test_a_sentence_that_ends_below_its_paragraph_runs_on() -> None:
    assert sentence("First. The [mass]{term} is\n\n$$m$$") == ("The mass is", True)
    assert sentence("The [mass]{term} is:\n\n$$m$$") == ("The mass is:", True)
