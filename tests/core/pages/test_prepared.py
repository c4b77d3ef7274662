"""What comes with the tool made ahead is what making it now gives."""

from __future__ import annotations

import gzip
import json
import runpy
from collections.abc import Callable
from pathlib import Path
from typing import Any

import brotli
import pytest

from coursebuild.core.files.resources import PREPARED, assets_dir, prepared_file, template_texts
from coursebuild.core.model.results import OutputFile
from coursebuild.core.pages.assets import SCRIPTS, Assets, compressed_files, page_script
from coursebuild.core.pages.fonts import GREEK, font_jobs, read_faces, subset_font
from coursebuild.core.pages.renderer import compile_templates, compiled_name

pytestmark = pytest.mark.site

ROOT = Path(__file__).parents[3]


def test_nothing_else_is_there() -> None:
    """If not, run `python site/bundle.py`."""
    folder = assets_dir() / PREPARED
    files = {*json.loads((folder / "fonts.json").read_bytes()).values()}
    files |= {*json.loads((folder / "copies.json").read_bytes()).values()}
    files |= {"fonts.json", "fonts.txt", "copies.json", compiled_name(template_texts())}
    assert {path.name for path in folder.iterdir()} == files


def test_the_fonts_that_most_courses_need_are_cut(assets: Assets) -> None:
    faces = read_faces(assets.file("fonts/fonts.json"))
    fonts = ((face, assets.file(f"fonts/{face.file}")) for face in faces)
    for job in font_jobs(fonts, "".join(GREEK), "∑"):
        assert prepared_file("fonts", job.key) == subset_font(job)
    assert prepared_file("fonts", "0" * 64) is None


def test_copies_are_up_to_date() -> None:
    """If not, run `python site/bundle.py`."""
    copies = runpy.run_path(str(ROOT / "site" / "prepare_copies.py"))["compress"](assets_dir())
    folder = assets_dir() / PREPARED
    assert copies == {name: (folder / name).read_bytes() for name in copies}


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


def test_templates_are_up_to_date(tmp_path: Path) -> None:
    """If not, run `python site/bundle.py`."""
    texts = template_texts()
    compile_templates(texts, tmp_path)
    name = compiled_name(texts)
    modules = {path.name: path.read_bytes() for path in (tmp_path / name).iterdir()}
    bundled = (assets_dir() / PREPARED / name).glob("*.py")
    assert {path.name: path.read_bytes() for path in bundled} == modules
