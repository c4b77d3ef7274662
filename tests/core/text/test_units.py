"""Valid units, and wrong ones with the units that their authors likely meant."""

from __future__ import annotations

from coursebuild.core.text.source import Excerpt, Source
from coursebuild.core.text.units import check_unit, find_unit

USUAL_UNITS = (
    *("", "1", "1/s²", "kg m^2", "kg·m²", "kg.m^2", "N m/rad", "m/s^{2}", "m s^-2", "m s⁻¹"),
    *("m / s", "J/(kg K)", "kg m²/(s K)", "m^(1/2)", "°", "°C", "%", "°/s", "kHz"),
)
RARE_UNITS = "sec metres ft psi eV Å rev/min rpm turn Nm µm \u2126 ‰".split()
INVALID_UNITS = (
    "(m",
    "m//s",
    "m^",
    "m**2",
    "2 m",
    "9**9**9 m",
    "m^99999999",
    "$",
    "m" * 200,
    "1/",
    "/",
)


def messages(unit: str) -> list[str]:
    source = Source("lesson.md", unit)
    return [f"{d.span.text}: {d.help}" for d in check_unit(Excerpt.of_span(source.span()))]


def test_valid_units() -> None:
    assert {unit: messages(unit) for unit in (*USUAL_UNITS, *RARE_UNITS) if messages(unit)} == {}


def test_wrong_units_are_reported_with_the_likely_one() -> None:
    likely = {
        **{"mtr": "m", "metr": "m", "radd/s": "rad", "rads": "rad", "KG": "kg", "hz": "Hz"},
        **{"kgm²": "kg m", "secnd": "s", "Newtons": "N"},
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
        ("mm²", "1e-6 m²"),
        ("J/(kg K)", "m²/(s² K)"),
        ("kHz", "1/ms"),
        ("μm", "µm"),
    ):
        assert find_unit(unit) is not None and find_unit(unit) == find_unit(same_unit), unit
    assert find_unit("m^12") != find_unit("m")
    assert find_unit("strides") is None
