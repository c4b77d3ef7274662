"""Fonts that come cut already are what cutting gives now."""

from __future__ import annotations

import runpy
from pathlib import Path
from typing import Any

import pytest

from coursebuild.effects.prepared import FOLDER, prepared_cut, prepared_source
from coursebuild.effects.resources import assets_dir
from coursebuild.render import Assets
from coursebuild.render.fonts import BASE, MATH, VERSION, FontJob, font_jobs, read_faces
from coursebuild.render.fonts import subset_font as cut

ROOT = Path(__file__).parents[2]


def test_they_are_up_to_date() -> None:
    """If not, run `python site/bundle.py`."""
    made = runpy.run_path(str(ROOT / "site" / "prepare_fonts.py"))["prepared"](assets_dir())
    there = {path.name: path.read_bytes() for path in (assets_dir() / FOLDER).iterdir()}
    assert there.keys() == made.keys()
    assert [name for name in made if made[name] != there[name]] == []


def jobs(assets: Assets, text: str, mathematics: str) -> dict[str, FontJob]:
    faces = read_faces(assets.file("fonts/fonts.json"))
    found = font_jobs(((f, assets.file(f"fonts/{f.file}")) for f in faces), text, mathematics)
    return {job.face.family: job for job in found}


@pytest.mark.parametrize(
    "formulas", ["x", "∫∑√≤αβΓ𝒪ℝ⟨⟩→⏟‖′", "".join(map(chr, range(0x391, 0x3A1)))]
)
def test_what_is_cut_from_the_smaller_font_is_what_is_cut_from_the_whole(
    assets: Any, formulas: str
) -> None:
    job = jobs(assets, "", formulas)[MATH]
    smaller = prepared_source(job.data, job.characters, VERSION)
    assert smaller is not None and len(smaller) < len(job.data) / 2
    assert cut(FontJob(job.face, smaller, job.characters)) == cut(job)


def test_others_are_not_taken_for_them(assets: Any) -> None:
    plain = jobs(assets, "".join(BASE), "x")
    for family, job in plain.items():
        assert (prepared_cut(job.key) is None) == (family == MATH)
    for family, job in jobs(assets, "".join(BASE) + "Ā", "x⎲").items():
        if family == MATH:
            assert prepared_source(job.data, job.characters, VERSION) is None
            assert prepared_source(job.data, "x", VERSION + 1) is None
    assert prepared_cut("0" * 64) is None
