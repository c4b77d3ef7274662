"""Sources, spans and excerpts; units."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from coursebuild.core.text.quantities import with_unit
from coursebuild.core.text.source import Excerpt, Source, Span
from coursebuild.core.text.units import check_unit, find_units
from support.fixture_cases import fixture_tables


@pytest.mark.parametrize(("text", "offset", "position"), fixture_tables("source")["positions"])
def test_position(text: str, offset: int, position: list[int]) -> None:
    assert [*Source("x.md", text).position(offset)] == position


def test_span_of_several_lines() -> None:
    source = Source("x.md", "one\ntwo\nthree")
    span = source.span(1, 9)
    assert (span.line, span.column, span.end_line, span.end_column) == (1, 2, 3, 2)
    assert span.first_line().text == "ne"
    assert span.to(source.span(10, 12)) == source.span(1, 12)
    assert source.span(0, 13).contains(span)
    assert not span.contains(source.span(0, 13))
    assert not Span(Source("y.md", "one"), 0, 3).contains(span)


def test_excerpt_of_prefixed_lines() -> None:
    source = Source("x.md", "> {\n>  1}\n")
    excerpt = Excerpt.join([Excerpt.of_span(source.span(*at)) for at in ((2, 3), (6, 9))], "\n")
    assert excerpt.span(3, 4).text == "1"
    assert excerpt.slice(2, 5).span(1, 3).text == "1}"
    assert excerpt.span().text == "{\n>  1}"
    assert [line.text for line in excerpt.lines()] == ["{", " 1}"]


@given(
    st.lists(st.text(alphabet="ab \t", max_size=6), min_size=1, max_size=8),
    st.sampled_from(["\n", "\r\n", "\r"]),
    st.data(),
)
def test_slices_of_excerpts_agree_with_the_source(
    lines: list[str], end: str, data: st.DataObject
) -> None:
    source = Source("x.md", end.join(lines))
    excerpt = source.excerpt()
    assert excerpt.text == "\n".join(lines)
    a = data.draw(st.integers(0, len(excerpt.text)))
    b = data.draw(st.integers(a, len(excerpt.text)))
    part = excerpt.slice(a, b)
    assert part.text == excerpt.text[a:b]
    for i, ch in enumerate(part.text):
        at = part.offset(i)
        assert at == excerpt.offset(a + i)
        assert source.text[at] == ch or (ch == "\n" and source.text[at] in "\r\n")
    assert part.span().text.replace("\r\n", "\n").replace("\r", "\n").rstrip(
        "\n"
    ) == part.text.rstrip("\n")


def test_spans_of_an_excerpt_longer_than_its_source_stay_in_it() -> None:
    source = Source("x.md", "abc")
    excerpt = Excerpt(source, "bc\n", ((0, 1),))  # a fence at the end of a text gets a line end
    assert (excerpt.span().end, excerpt.slice(2).span().start, excerpt.offset(3)) == (3, 3, 3)


USUAL_UNITS = (
    *("", "1", "1/s²", "kg m^2", "kg·m²", "kg.m^2", "N m/rad", "m/s^{2}", "m s^-2", "m s⁻¹"),
    *("m / s", "J/(kg K)", "kg m²/(s K)", "m^(1/2)", "°", "°C", "%", "°/s", "kHz"),
)
RARE_UNITS = "sec metres ft psi eV Å rev/min rpm turn Nm µm \u2126 ‰".split()
INVALID_UNITS = fixture_tables("source")["units"]


def messages(unit: str) -> list[str]:
    source = Source("lesson.md", unit)
    return [f"{d.span.text}: {d.help}" for d in check_unit(Excerpt.of_span(source.span()))]


def test_valid_units() -> None:
    assert {unit: messages(unit) for unit in (*USUAL_UNITS, *RARE_UNITS) if messages(unit)} == {}


def test_only_the_degree_stands_at_its_number() -> None:
    texts = [with_unit("5", unit) for unit in ("kg", "°", "°C", "")]
    assert texts == ["5 kg", "5°", "5 °C", "5"]


def test_wrong_units_are_reported_with_the_likely_one() -> None:
    likely = {
        **{"metr": "m", "meterr": "m", "radd/s": "rad", "rads": "rad", "KG": "kg", "hz": "Hz"},
        **{"secnd": "s", "Newtons": "N"},
    }
    for word, unit in likely.items():
        assert [m.partition(": ")[2] for m in messages(word)] == [f"did you mean `{unit}`?"], word
    assert messages("strides") == ["strides: leave it out, and name in words what is counted"]
    assert [unit for unit in INVALID_UNITS if not messages(unit)] == []


def test_units_that_are_equal_have_one_size_and_one_dimension() -> None:
    for unit, same_unit in (
        ("N m", "kg m^2/s^2"),
        ("m/m", "1"),
        ("m^12", "m^6 m^6"),
        ("mm²", "µm m"),
        ("J/(kg K)", "m²/(s² K)"),
        ("kHz", "1/ms"),
        ("μm", "µm"),
        ("psi", "lbf/in^2"),
        ("metres per second", "m s^{-1}"),
        ("rpm", "rev/min"),
        ("kWh", "kW h"),
    ):
        pairs = [find_units(text) for text in (unit, same_unit)]
        assert all(pairs) and pairs[0][0].is_same(pairs[1][0]), unit
    for unit, another_unit in (
        ("m^12", "m"),
        ("Hz", "rad/s"),
        ("°C", "K"),
        ("N m", "N"),
        ("rpm", "Hz"),
    ):
        assert not any(a.is_same(b) for a in find_units(unit) for b in find_units(another_unit)), (
            unit
        )
    assert find_units("strides") == find_units("m//s") == find_units("link") == ()
    assert len(find_units("J/kg K")) == len(find_units("rpm")) == 2
