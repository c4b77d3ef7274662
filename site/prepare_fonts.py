"""Makes the fonts that come with the tool ready to be cut, and cuts those that most courses need.

    python site/prepare_fonts.py FOLDER [OLD]

`site/bundle.py` calls it with the bundle that it makes, and with the old one, from which the
results are taken where nothing has changed. See `coursebuild/core/pages/theme.py`.

1. The weights that no style sheet asks for are cut away, and so are hints and most names.
2. In a font for mathematics the larger radicals become as narrow as the smallest: Chromium gives
   every root room for the widest of them, and leaves what is not needed as a gap behind the root.
3. What fonts hold and measure is noted in their list, so that none is read for it.
"""

import hashlib
import io
import json
import shutil
import sys
from pathlib import Path
from typing import Any

from fontTools import subset
from fontTools.ttLib import TTFont
from fontTools.varLib import instancer

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from coursebuild.core.pages import theme

WEIGHTS = dict.fromkeys((theme.TEXT, theme.INTERFACE, theme.CODE), (400, 700))
"""The weights that the style sheet uses."""
RADICAL = "√"
WIDEST = 1.07
"""A radical's advance width in those of the smallest: what is more than 1 stays as a thin space."""


def prepare_font(data: bytes, weights: tuple[int, int] | None) -> TTFont:
    """Prepare a font to be cut: with these weights only, if it has several."""
    options = subset.Options()
    options.hinting = False
    options.notdef_outline = True
    options.layout_features = ["*"]
    options.name_IDs = [0, 1, 2, 3, 4, 5, 6, 13, 14]
    options.recalc_timestamp = False
    font = TTFont(io.BytesIO(data), recalcTimestamp=False)
    subsetter = subset.Subsetter(options)
    subsetter.populate(unicodes=font.getBestCmap())
    subsetter.subset(font)
    if weights is not None and "fvar" in font:
        instancer.instantiateVariableFont(font, {"wght": weights}, inplace=True)
    narrow_radicals(font)
    font.flavor = None
    return font


def narrow_radicals(font: TTFont) -> None:
    """Make the larger radicals, and the pieces of the largest, narrow; idempotent.

    MathML Core: the preferred inline size of a stretched operator is that of its widest variant.
    """
    smallest = font.getBestCmap().get(ord(RADICAL))
    if smallest is None or "MATH" not in font or "glyf" not in font:
        return
    variants = font["MATH"].table.MathVariants
    construction = dict(
        zip(variants.VertGlyphCoverage.glyphs, variants.VertGlyphConstruction, strict=True)
    ).get(smallest)
    if construction is None:
        return
    names = {variant.VariantGlyph for variant in construction.MathGlyphVariantRecord}
    if construction.GlyphAssembly is not None:
        names |= {part.glyph for part in construction.GlyphAssembly.PartRecords}
    advances, glyphs = font["hmtx"], font["glyf"]
    widest = round(WIDEST * advances[smallest][0])
    for name in sorted(names):
        advance, _ = advances[name]
        glyph = glyphs[name]
        if advance > widest and glyph.numberOfContours > 0:
            glyph.coordinates.scale((widest / advance, 1))
            glyph.coordinates.toInt()
            glyph.recalcBounds(glyphs)
            advances[name] = (widest, glyph.xMin)


def prepare(folder: Path, cuts: Path) -> None:
    """Put prepared fonts in the place of those in a folder, and cut some into another."""
    listing = folder / "fonts.json"
    faces: list[dict[str, Any]] = json.loads(listing.read_bytes())
    for face in faces:
        source = folder / face["file"]
        face["file"] = source.with_suffix(".ttf").name
        data = source.read_bytes()
        source.unlink()
        weights = WEIGHTS.get(face["family"])
        face["weight"] = weights or face["weight"]
        with prepare_font(data, weights) as font:
            face["measure"] = theme.measure_font(font)
            characters = "".join(sorted(map(chr, font.getBestCmap())))
            face["characters"] = theme.unicode_range(characters)
            font.save(folder / face["file"])
    listing.write_text(json.dumps(faces, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
    files_by_key: dict[str, str] = {}
    prepared_faces = theme.read_faces(listing.read_bytes())
    faces_with_data = [(face, (folder / face.file).read_bytes()) for face in prepared_faces]
    for job in theme.font_jobs(faces_with_data, "".join(theme.GREEK), " "):
        files_by_key[job.key] = job.face.file.replace(".ttf", ".woff2")
        (cuts / files_by_key[job.key]).write_bytes(theme.subset_font(job))
    text = json.dumps(files_by_key, indent=1, sort_keys=True)
    (cuts / "fonts.json").write_text(f"{text}\n", encoding="utf-8")


def hash_sources(bundle: Path) -> str:
    """A hash of the fonts and of the modules that cut them."""
    digest = hashlib.sha256()
    for path in (
        *map(Path, (__file__, theme.__file__)),
        *sorted((bundle / "fonts").iterdir()),
    ):
        digest.update(f"{path.name}\0".encode() + path.read_bytes())
    return digest.hexdigest()


def main(bundle: Path, old: Path | None) -> None:
    """Prepare the fonts of a bundle."""
    target, stamp = bundle / "prepared", hash_sources(bundle)
    target.mkdir()
    if old is not None and has_text(old / "prepared" / "fonts.txt", stamp):
        shutil.rmtree(bundle / "fonts")
        shutil.copytree(old / "fonts", bundle / "fonts")
        for path in (old / "prepared").glob("*.woff2"):
            shutil.copy(path, target)
        shutil.copy(old / "prepared" / "fonts.json", target)
    else:
        prepare(bundle / "fonts", target)
    (target / "fonts.txt").write_text(stamp, encoding="utf-8")


def has_text(path: Path, text: str) -> bool:
    """Whether a file holds exactly a text."""
    return path.is_file() and path.read_text(encoding="utf-8") == text


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:2]), Path(sys.argv[2]) if len(sys.argv) > 2 else None)
