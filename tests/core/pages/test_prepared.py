"""Fonts, templates and compressed copies: what comes with the tool made ahead, or is kept."""

from __future__ import annotations

import gzip
import io
import json
import re
import runpy
from collections.abc import Callable
from pathlib import Path
from typing import Any

import brotli
import pytest
from fontTools.ttLib import TTFont
from jinja2 import TemplateNotFound, UndefinedError
from markupsafe import Markup

from coursebuild.core.files.resources import PREPARED, assets_dir, prepared_file, template_texts
from coursebuild.core.model.results import OutputFile
from coursebuild.core.pages.assets import SCRIPTS, Assets, compressed_files, page_script
from coursebuild.core.pages.renderer import compile_templates, compiled_name, templates_of
from coursebuild.core.pages.theme import (
    CODE,
    FALLBACKS,
    GREEK,
    INTERFACE,
    MATH,
    TEXT,
    FontJob,
    characters_in,
    face_rules,
    font_jobs,
    fonts_at_once,
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
    locals_scaled = {"Times New Roman": "111.", "DejaVu Serif": "87.1", "DejaVu Sans": "82.0"}
    for local, scale in locals_scaled.items():
        rule = css.split(f'local("{local}"')[1].split("}")[0]
        assert f"size-adjust:{scale}" in rule, "as wide as the web font"
    assert 'font-family:"STIX Two Math";font-style:normal;font-weight:400;' in css
    displays = dict(re.findall(r'font-family:"([^"]+)".*?font-display:(\w+)', css))
    assert displays == {TEXT: "optional", INTERFACE: "optional", CODE: "swap", MATH: "swap"}


def test_a_page_fetches_the_fonts_of_its_first_lines_at_once(assets: Assets) -> None:
    cut_fonts = [(job, job.face.file) for job in jobs(assets, "αβ")]
    assert fonts_at_once(cut_fonts) == (
        ("", "source-serif-4-latin-opsz-normal.ttf"),
        ("", "source-sans-3-latin-wght-normal.ttf"),
        ("<math", "stix-two-math-latin-400-normal.ttf"),
    )


SCRIPT = b"function f(x) { return x * x + 1 }\n" * 300


def copies(path: str, data: bytes) -> list[OutputFile]:
    files = compressed_files([OutputFile(path, data)], lambda key, make: make())
    return [OutputFile(file.path, file.make()) for file in files]


def test_an_asset_gets_a_brotli_and_a_gzip_copy() -> None:
    for suffix in ("js", "css", "wasm", "json", "mjb", "svg"):
        path = f"assets/labs/x.1234abcd.{suffix}"
        first, second = copies(path, SCRIPT)
        assert (first.path, second.path) == (f"{path}.br", f"{path}.gz")
        assert brotli.decompress(first.data) == gzip.decompress(second.data) == SCRIPT
        assert second.data[4:8] == b"\0\0\0\0", "gzip's time"


def test_pages_pictures_fonts_and_archives_get_no_copy() -> None:
    for path in ("index.html", "lessons/x.js", "assets/x.png", "assets/fonts/x.woff2", "x.zip"):
        assert copies(path, SCRIPT) == []


def test_what_is_below_8_kib_gets_no_copy() -> None:
    assert copies("assets/x.js", SCRIPT[:8191]) == []
    assert len(copies("assets/x.js", SCRIPT[:8192])) == 2


def test_what_is_large_is_compressed_less_finely() -> None:
    """From 2 MiB on, where the finer way takes long."""
    large = (SCRIPT * 200)[: 2 << 20]
    for data, quality in ((large[:-1], 10), (large, 9)):
        brotli_copy, _ = copies("assets/x.js", data)
        assert brotli_copy.data == brotli.compress(data, quality=quality)


TEXTS = (
    ("page.html", "<p>{{ a }}{% include 'part.html' %}</p>\n"),
    ("part.html", "{% for x in b %}{{ x }}{% if not loop.last %}, {% endif %}{% endfor %}\n"),
    ("strings/en.toml", "a = 1"),
)
VALUES = {"a": "<&>", "b": (Markup("<b>1</b>"), "2")}
RENDERED_HTML = "<p>&lt;&amp;&gt;<b>1</b>, 2</p>\n"


def test_compiled_templates_write_what_their_texts_do(tmp_path: Path) -> None:
    compile_templates(TEXTS, tmp_path)
    for folder in (tmp_path, None):
        assert templates_of(TEXTS, folder).get_template("page.html").render(VALUES) == RENDERED_HTML


def test_an_edited_template_is_not_taken_from_what_was_compiled(tmp_path: Path) -> None:
    compile_templates(TEXTS, tmp_path)
    texts = (TEXTS[0], ("part.html", "edited"))
    assert templates_of(texts, tmp_path).get_template("part.html").render() == "edited"


def test_what_is_not_there_is_an_error() -> None:
    for text in ("{{ a }}", "{% if a %}{% endif %}", "{{ t.missing }}"):
        with pytest.raises(UndefinedError):
            templates_of((("x.html", text),)).get_template("x.html").render(t="")
    with pytest.raises(TemplateNotFound):
        templates_of(()).get_template("x.html")


ROOT = Path(__file__).parents[3]


@pytest.mark.site
def test_nothing_else_is_there() -> None:
    """If not, run `python site/bundle.py`."""
    folder = assets_dir() / PREPARED
    files = {*json.loads((folder / "fonts.json").read_bytes()).values()}
    files |= {*json.loads((folder / "copies.json").read_bytes()).values()}
    files |= {"fonts.json", "fonts.txt", "copies.json", compiled_name(template_texts())}
    assert {path.name for path in folder.iterdir()} == files


@pytest.mark.site
def test_the_fonts_that_most_courses_need_are_cut(assets: Assets) -> None:
    faces = read_faces(assets.file("fonts/fonts.json"))
    fonts = ((face, assets.file(f"fonts/{face.file}")) for face in faces)
    for job in font_jobs(fonts, "".join(GREEK), "∑"):
        assert prepared_file("fonts", job.key) == subset_font(job)
    assert prepared_file("fonts", "0" * 64) is None


@pytest.mark.site
def test_copies_are_up_to_date() -> None:
    """If not, run `python site/bundle.py`."""
    copies = runpy.run_path(str(ROOT / "site" / "prepare_copies.py"))["compress"](assets_dir())
    folder = assets_dir() / PREPARED
    assert copies == {name: (folder / name).read_bytes() for name in copies}


@pytest.mark.site
def test_a_copy_is_that_of_the_script_as_it_is_published(assets: Any) -> None:
    """The compressible files that pages of every course refer to, except the style sheet."""
    copies_by_key: dict[str, bytes | None] = {}

    def keep(key: str, make: Callable[[], bytes]) -> bytes:
        copies_by_key[key] = prepared_file("copies", key)
        return copies_by_key[key] or make()

    scripts = [OutputFile(f"assets/{n}", page_script(assets.file(f))) for n, f in SCRIPTS.items()]
    copies = compressed_files(scripts, keep)
    assert {"assets/site.js.br", "assets/search.js.gz"} <= {copy.path for copy in copies}
    whole = {file.path: file.data for file in scripts}
    for copy in copies:
        path, _, suffix = copy.path.rpartition(".")
        undo = brotli.decompress if suffix == "br" else gzip.decompress
        assert undo(copy.make()) == whole[path]
    assert None not in copies_by_key.values()
    assert prepared_file("copies", "0" * 64) is None


@pytest.mark.site
def test_templates_are_up_to_date(tmp_path: Path) -> None:
    """If not, run `python site/bundle.py`."""
    texts = template_texts()
    compile_templates(texts, tmp_path)
    name = compiled_name(texts)
    modules = {path.name: path.read_bytes() for path in (tmp_path / name).iterdir()}
    bundled = (assets_dir() / PREPARED / name).glob("*.py")
    assert {path.name: path.read_bytes() for path in bundled} == modules
