"""Fonts cut to what a site uses: right glyphs, the MATH table, the same bytes each time."""

from __future__ import annotations

import io

import pytest
from fontTools.ttLib import TTFont

from coursebuild.core.pages.assets import Assets
from coursebuild.core.pages.fonts import (
    CODE,
    FALLBACKS,
    MATH,
    TEXT,
    FontJob,
    characters_in,
    face_rules,
    font_jobs,
    italic_letter,
    read_faces,
    subset_font,
    unicode_range,
)

SAMPLES = {
    "latin": "AZaz09 é×÷±²−“”…",
    "latin-ext": "ĀčłŐŽ",
    "vietnamese": "ăĐơưẠỹ",
    "greek": "ΑΩαβγδθλμπσφω",
    "cyrillic": "АЯаяёі",
}
FORMULAS = "I=∫Vρ(‖𝐫‖2𝟙−⊤)dω∑√{}[]⟨⟩≥·˙ˆ𝝎mkc∂∇h"


def jobs(assets: Assets, text: str, mathematics: str = FORMULAS) -> tuple[FontJob, ...]:
    faces = read_faces(assets.file("fonts/fonts.json"))
    data = ((face, assets.file(f"fonts/{face.file}")) for face in faces)
    return font_jobs(data, text, mathematics)


def jobs_of(all_jobs: tuple[FontJob, ...], family: str, style: str = "normal") -> list[FontJob]:
    return [job for job in all_jobs if (job.face.family, job.face.style) == (family, style)]


def font_of(job: FontJob) -> TTFont:
    return TTFont(io.BytesIO(subset_font(job)))


@pytest.fixture(scope="module")
def mathematical(assets: Assets) -> TTFont:
    (job,) = jobs_of(jobs(assets, ""), MATH)
    assert len(subset_font(job)) < 80_000
    return font_of(job)


def test_a_text_font_has_what_the_pages_use_its_axes_and_their_names(assets: Assets) -> None:
    (latin,) = jobs_of(jobs(assets, "ordinary text"), TEXT)
    font = font_of(latin)
    assert set("The quick brown fox, 1–2 “x” …") <= set(map(chr, font.getBestCmap()))
    axes = {axis.axisTag: (axis.minValue, axis.maxValue) for axis in font["fvar"].axes}
    assert axes["wght"] == (400, 700)
    assert axes["opsz"][0] < 10 < 40 < axes["opsz"][1]
    name_ids = {1, 2, 4, 6, *(axis.axisNameID for axis in font["fvar"].axes)}
    assert name_ids <= {name.nameID for name in font["name"].names}
    assert len(subset_font(latin)) < 75_000


def test_other_scripts_come_only_where_they_are_used(assets: Assets) -> None:
    plain = jobs(assets, "ordinary")
    mixed = jobs(assets, "Łódź, привет")
    assert {job.face.subset for job in jobs_of(plain, TEXT)} == {"latin"}
    assert {job.face.subset for job in jobs_of(mixed, TEXT)} == {"latin", "latin-ext", "cyrillic"}
    cyrillic = next(job for job in jobs_of(mixed, TEXT) if job.face.subset == "cyrillic")
    assert cyrillic.characters == "веипрт"


def test_no_character_is_in_two_files_of_a_face(assets: Assets) -> None:
    for style in ("normal", "italic"):
        characters = [
            c for job in jobs_of(jobs(assets, "†łα → x̄"), TEXT, style) for c in job.characters
        ]
        assert len(characters) == len(set(characters))


def test_the_math_font_keeps_its_table_variants_and_italics(mathematical: TTFont) -> None:
    font = mathematical
    cmap = font.getBestCmap()
    characters = set(FORMULAS) | {italic_letter(c) for c in "IVrdmkcω"} | {"ℎ", "𝐻", "𝜕", "𝛻"}
    assert {c for c in characters if ord(c) not in cmap} == set()
    table = font["MATH"].table
    assert table.MathConstants.AxisHeight.Value > 0
    variants = table.MathVariants
    stretchy = dict(
        zip(variants.VertGlyphCoverage.glyphs, variants.VertGlyphConstruction, strict=True)
    )
    assembly = stretchy[cmap[ord("(")]].GlyphAssembly
    assert len(assembly.PartRecords) >= 3
    assert stretchy[cmap[ord("∫")]].VariantCount >= 2
    assert {part.glyph for part in assembly.PartRecords} <= set(font.getGlyphOrder())


def test_no_radical_is_much_wider_than_the_smallest(mathematical: TTFont) -> None:
    """A browser leaves room for the widest one after each root."""
    font = mathematical
    radical = font.getBestCmap()[ord("√")]
    variants = font["MATH"].table.MathVariants
    construction = variants.VertGlyphConstruction[variants.VertGlyphCoverage.glyphs.index(radical)]
    names = {variant.VariantGlyph for variant in construction.MathGlyphVariantRecord}
    names |= {part.glyph for part in construction.GlyphAssembly.PartRecords}
    assert len(names) >= 5
    for name in names:
        advance, bearing = font["hmtx"][name]
        assert advance <= 1.07 * font["hmtx"][radical][0] + 1
        assert bearing == font["glyf"][name].xMin
        assert font["glyf"][name].xMax >= 0.7 * advance, "it meets the line"


def test_a_site_without_formulas_has_no_math_font(assets: Assets) -> None:
    assert jobs_of(jobs(assets, "text", ""), MATH) == []
    assert len(jobs_of(jobs(assets, "text", ""), CODE)) == 1


def test_the_same_job_gives_the_same_bytes_and_key(assets: Assets) -> None:
    first, second = jobs(assets, "text"), jobs(assets, "text")
    assert [job.key for job in first] == [job.key for job in second]
    small, again = (jobs_of(jobs(assets, "привет"), CODE)[1] for _ in range(2))
    assert small.face.subset == "cyrillic"
    assert subset_font(small) == subset_font(again)
    assert {job.key for job in first}.isdisjoint(
        job.key for job in jobs(assets, "text é ñ", FORMULAS + "ℵ") if job.face.subset == "latin"
    )


@pytest.mark.parametrize(
    ("css", "text"),
    [("U+61-63, U+65", "abce"), ("u+0041", "A"), ("U+003?", "0123456789:;<=>?"), ("U+1F600", "😀")],
)
def test_characters_of_a_unicode_range(css: str, text: str) -> None:
    assert characters_in(css) == set(text)
    assert characters_in(unicode_range("".join(sorted(text)))) == set(text)


def test_the_list_of_fonts_says_what_they_hold(assets: Assets) -> None:
    for face in read_faces(assets.file("fonts/fonts.json")):
        font = TTFont(io.BytesIO(assets.file(f"fonts/{face.file}")), lazy=True)
        assert characters_in(face.characters) == set(map(chr, font.getBestCmap()))
        assert set(SAMPLES[face.subset]) <= characters_in(face.characters), face.file
        assert (face.measure is not None) == (face.subset == "latin")
        assert (face.style == "italic") == bool(font["head"].macStyle & 2), face.file
        if face.family == MATH:
            assert "MATH" in font and set("∫√∂∇⟨≈") <= characters_in(face.characters)
        else:
            axis = next(axis for axis in font["fvar"].axes if axis.axisTag == "wght")
            assert [*face.weight] == [axis.minValue, axis.maxValue], face.file


def test_rules_have_fallbacks_of_the_same_measure(assets: Assets) -> None:
    cut_fonts = jobs(assets, "text")
    css = face_rules((job, f"fonts/{job.face.file}") for job in cut_fonts)
    assert css.count("@font-face") == len(cut_fonts) + len(FALLBACKS)
    assert 'font-family:"Source Serif 4 Variable fallback";font-style:normal;src:local(' in css
    for local, scale in (("Times New Roman", "111."), ("DejaVu Serif", "87.1")):
        rule = css.split(f'local("{local}"')[1].split("}")[0]
        assert f"size-adjust:{scale}" in rule, "as wide as the web font"
    assert 'font-family:"STIX Two Math";font-style:normal;font-weight:400;' in css
    assert css.count("font-display:swap") == len(cut_fonts)
