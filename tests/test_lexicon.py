"""A lexicon whose rows are away, and what needs none of them."""

from __future__ import annotations

import pickle

from coursebuild.model import DefinedTerm, Equation, Lexicon, SymbolUse
from coursebuild.values import replace

WHOLE = Lexicon(
    (DefinedTerm("term-a", "a", "a", ()),),
    (SymbolUse("<mi>q</mi>", 0, "an angle", "rad"),),
    (("one", "One"),),
    (Equation("e1", "1"), Equation("e2")),
)


def test_it_is_equal_to_one_that_is_here() -> None:
    away = Lexicon.away(WHOLE.terms, lambda: WHOLE.rows)
    assert away == WHOLE
    assert away.rows == WHOLE.rows
    assert away.numbers == {"e1": "1"}
    assert pickle.loads(pickle.dumps(away)) == WHOLE
    assert replace(away, terms=()) == replace(WHOLE, terms=())


def test_terms_are_had_without_the_rows() -> None:
    rows = iter([WHOLE.rows])
    lexicon = Lexicon.away(WHOLE.terms, lambda: next(rows))
    assert lexicon.terms == WHOLE.terms
    assert lexicon.symbols == WHOLE.symbols
    assert not tuple(rows), "they were asked for once"
    assert not hasattr(lexicon, "nothing")
