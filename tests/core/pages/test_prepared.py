"""What comes with the tool made ahead is what making it now gives."""

from __future__ import annotations

import gzip
import io
import json
import runpy
from collections.abc import Callable
from pathlib import Path
from typing import Any

import brotli
import pytest
from fontTools.pens.boundsPen import BoundsPen
from fontTools.ttLib import TTFont

from coursebuild.core.engine.prepared import (
    FOLDER,
    prepared_copy,
    prepared_cut,
    prepared_source,
)
from coursebuild.core.files.resources import assets_dir, template_texts
from coursebuild.core.model.results import OutputFile
from coursebuild.core.pages.assets import SCRIPTS, Assets, page_script
from coursebuild.core.pages.compressed import compressed_files
from coursebuild.core.pages.cutting import covered, measured
from coursebuild.core.pages.fonts import (
    BASE,
    MATH,
    VERSION,
    FontJob,
    characters_in,
    font_jobs,
    read_faces,
    ready_font,
)
from coursebuild.core.pages.fonts import subset_font as cut
from coursebuild.core.pages.templates import archive_name, compile_templates

pytestmark = pytest.mark.site

ROOT = Path(__file__).parents[3]


def test_they_are_up_to_date() -> None:
    """If not, run `python site/bundle.py`."""
    making = runpy.run_path(str(ROOT / "site" / "prepare_fonts.py"))
    folder = assets_dir() / FOLDER
    listing = json.loads((folder / "fonts.json").read_bytes())
    assert listing["made_from"] == making["made_from"](assets_dir())
    files = {*listing["cuts"].values(), *(found["file"] for found in listing["smaller"].values())}
    files |= set(json.loads((folder / "copies.json").read_bytes()).values())
    files |= {"fonts.json", "copies.json", archive_name(template_texts())}
    assert {path.name for path in folder.iterdir()} == files


def test_copies_are_up_to_date() -> None:
    """If not, run `python site/bundle.py`."""
    made = runpy.run_path(str(ROOT / "site" / "prepare_copies.py"))["prepared"](assets_dir())
    folder = assets_dir() / FOLDER
    assert made == {name: (folder / name).read_bytes() for name in made}


def test_a_copy_is_that_of_the_script_as_it_is_published(assets: Any) -> None:
    """All that pages of every course refer to and that shrinks, but for the style sheet."""
    asked: dict[str, bytes | None] = {}

    def keep(key: str, make: Callable[[], bytes]) -> bytes:
        asked[key] = prepared_copy(key)
        return asked[key] or make()

    names = [name for name in SCRIPTS if name != "theme.js"]  # which is too small
    scripts = [OutputFile(f"assets/{n}", page_script(assets.file(SCRIPTS[n]))) for n in names]
    copies = compressed_files(scripts, keep)
    assert None not in asked.values()
    assert len(copies) == 2 * len(names)
    whole = {file.path: file.data for file in scripts}
    for copy in copies:
        path, _, suffix = copy.path.rpartition(".")
        undo = brotli.decompress if suffix == "br" else gzip.decompress
        assert undo(copy.data) == whole[path]
    assert prepared_copy("0" * 64) is None


@pytest.mark.slow
def test_making_them_again_gives_the_same(assets: Any) -> None:
    for face in read_faces(assets.file("fonts/fonts.json")):
        if face.subset in ("greek", "vietnamese"):
            data = assets.file(f"fonts/{face.file}")
            characters = "".join(sorted(covered(data)))
            made = ready_font(FontJob(face, data, characters))
            assert made == prepared_source(data, characters, VERSION)


def jobs(assets: Assets, text: str, mathematics: str) -> dict[str, FontJob]:
    faces = read_faces(assets.file("fonts/fonts.json"))
    found = font_jobs(((f, assets.file(f"fonts/{f.file}")) for f in faces), text, mathematics)
    return {f"{job.face.family} {job.face.subset} {job.face.style}": job for job in found}


def described(data: bytes) -> dict[str, object]:
    """What a browser makes of a font."""
    font = TTFont(io.BytesIO(data))
    kerning = font["GPOS"].table if "GPOS" in font else None
    substitutes = font["GSUB"].table if "GSUB" in font else None
    tables = [table for table in (kerning, substitutes) if table is not None]
    return {
        "characters": {c: font["hmtx"][g] for c, g in font.getBestCmap().items()},
        "glyphs": {g: bounds(font, g) for g in font.getGlyphOrder()},
        "axes": [(a.axisTag, a.minValue, a.maxValue) for a in font["fvar"].axes]
        if "fvar" in font
        else [],
        "features": [
            {record.FeatureTag for record in table.FeatureList.FeatureRecord} for table in tables
        ],
        "lookups": [len(table.LookupList.Lookup) if table.LookupList else 0 for table in tables],
        "variants": sorted(font["MATH"].table.MathVariants.VertGlyphCoverage.glyphs)
        if "MATH" in font
        else [],
        "varying": sorted(font["gvar"].variations) if "gvar" in font else [],
    }


def bounds(font: TTFont, glyph: str) -> tuple[int, ...]:
    pen = BoundsPen(font.getGlyphSet())
    font.getGlyphSet()[glyph].draw(pen)
    return pen.bounds


@pytest.mark.parametrize(
    ("text", "formulas"),
    [
        ("ordinary", "x"),
        pytest.param("λ, Ωμέγα für ça naïve œuvre", "∫∑√≤αβΓ𝒪ℝ⟨⟩→⏟‖′", marks=pytest.mark.slow),
        pytest.param("Łódź приветствие Việt", "ΑΒΓΔΕΖΗΘΙΚΛΜΝΞΟΠ", marks=pytest.mark.slow),
    ],
)
def test_what_is_cut_from_a_ready_font_is_what_is_cut_from_the_whole(
    assets: Any, text: str, formulas: str
) -> None:
    for name, job in jobs(assets, text, formulas).items():
        if name.endswith("latin italic"):  # the slowest, and much like the others
            continue
        ready = prepared_source(job.data, job.characters, VERSION)
        assert ready is not None
        made, plain = cut(FontJob(job.face, ready, job.characters)), cut(job)
        assert described(made) == described(plain)
        assert len(made) < 1.02 * len(plain) + 20


def test_every_name_that_a_font_refers_to_is_there(assets: Any) -> None:
    for job in jobs(assets, "λ", "x").values():
        ready = prepared_source(job.data, job.characters, VERSION)
        assert ready is not None
        font = TTFont(io.BytesIO(cut(FontJob(job.face, ready, job.characters))))
        axes = font["fvar"].axes if "fvar" in font else []
        wanted = {1, 2, 4, 6, *(axis.axisNameID for axis in axes)}
        assert wanted <= {name.nameID for name in font["name"].names}


def test_others_are_not_taken_for_them(assets: Any) -> None:
    plain = jobs(assets, "".join(BASE), "x")
    for job in plain.values():
        assert (prepared_cut(job.key) is None) == (job.face.family == MATH)
        assert prepared_source(job.data, "x", VERSION + 1) is None
    rare = next(j for j in jobs(assets, "", "x⎲").values() if j.face.family == MATH)
    assert prepared_source(rare.data, rare.characters, VERSION) is None
    assert prepared_source(rare.data + b"x", "x", VERSION) is None
    assert prepared_cut("0" * 64) is None


def test_what_the_list_notes_of_the_fonts_is_what_they_say(assets: Any) -> None:
    for face in read_faces(assets.file("fonts/fonts.json")):
        data = assets.file(f"fonts/{face.file}")
        assert characters_in(face.characters) == covered(data)
        assert face.measure == measured(data)
        assert (face.measure is not None) == (face.subset == "latin")


def test_templates_are_up_to_date(tmp_path: Path) -> None:
    """If not, run `python site/bundle.py`."""
    texts = template_texts()
    compile_templates(texts, tmp_path)
    name = archive_name(texts)
    assert (assets_dir() / FOLDER / name).read_bytes() == (tmp_path / name).read_bytes()
