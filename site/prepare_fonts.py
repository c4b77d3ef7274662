"""Cuts the fonts that come with the tool cut already: see `coursebuild/core/engine/prepared.py`.

    python site/prepare_fonts.py FOLDER [OLD]

`site/bundle.py` calls it with the bundle that it makes, and the one that there was, from which the
results are taken where nothing has changed.
"""

import hashlib
import json
import shutil
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from msgspec.structs import replace

from coursebuild.core.pages import cutting, fonts

OFTEN = (
    *range(0x20, 0x7F),
    *range(0xA0, 0x100),
    *range(0x2C6, 0x2DE),  # accents
    *range(0x300, 0x339),
    *range(0x391, 0x3F7),  # Greek
    *range(0x2010, 0x2065),  # punctuation
    *range(0x20D0, 0x20F0),
    *range(0x2100, 0x2150),  # letters in use as symbols
    *range(0x2190, 0x2300),  # arrows, operators, relations
    *range(0x2308, 0x230C),
    *range(0x23B4, 0x23B6),
    *range(0x23DC, 0x23E2),  # braces above and below
    *(0x25A1, 0x25B3, 0x25BD, 0x25CB, 0x25EF, 0x25FB),
    *range(0x27C0, 0x2800),
    *range(0x2A00, 0x2A10),
    *range(0x2A7D, 0x2AB1),
    *range(0x1D400, 0x1D800),  # letters in the styles of mathematics
)
"""Code points that formulas use at all often."""


def prepared(bundle: Path) -> dict[str, bytes]:
    """The files, by name."""
    files: dict[str, bytes] = {}
    cuts: dict[str, str] = {}
    smaller: dict[str, dict[str, str]] = {}
    listed = fonts.read_faces((bundle / "fonts" / "fonts.json").read_bytes())
    faces = [(face, (bundle / "fonts" / face.file).read_bytes()) for face in listed]
    ready: dict[str, bytes] = {}
    for face, data in faces:
        often = set(map(chr, OFTEN)) if face.family == fonts.MATH else cutting.covered(data)
        characters = "".join(sorted(often & cutting.covered(data)))
        made = fonts.ready_font(fonts.FontJob(face, data, characters))
        ready[face.file] = made
        name = face.file.replace(".woff2", ".ttf")
        files[name] = made
        key = f"{fonts.VERSION}/{hashlib.sha256(data).hexdigest()}"
        smaller[key] = {"file": name, "characters": characters}
    for job in fonts.font_jobs(faces, "".join(fonts.BASE), ""):
        files[job.face.file] = fonts.finest_font(replace(job, data=ready[job.face.file]))
        cuts[job.key] = job.face.file
    listing = {"made_from": made_from(bundle), "cuts": cuts, "smaller": smaller}
    text = json.dumps(listing, indent=1, ensure_ascii=False, sort_keys=True) + "\n"
    return {**files, "fonts.json": text.encode()}


def made_from(bundle: Path) -> str:
    """A hash of the fonts and of what cuts them."""
    digest = hashlib.sha256()
    for path in map(Path, (__file__, fonts.__file__, cutting.__file__)):
        digest.update(f"{path.name}\0".encode() + path.read_bytes())
    for face in fonts.read_faces((bundle / "fonts" / "fonts.json").read_bytes()):
        whole = replace(face, characters="", measure=None)  # which may not be noted yet
        digest.update(f"{whole}\0".encode() + (bundle / "fonts" / face.file).read_bytes())
    return digest.hexdigest()


def noted(bundle: Path) -> bytes:
    """The list of the fonts, with what is otherwise found by reading them."""
    path = bundle / "fonts" / "fonts.json"
    faces = json.loads(path.read_bytes())
    for face in faces:
        data = (bundle / "fonts" / face["file"]).read_bytes()
        face["characters"] = fonts.unicode_range("".join(sorted(cutting.covered(data))))
        face["measure"] = cutting.measured(data)
    return (json.dumps(faces, indent=2, ensure_ascii=False) + "\n").encode()


def main(bundle: Path, old: Path | None) -> None:
    """Write them into the bundle."""
    target = bundle / "prepared"
    if old is not None and is_from(old / "prepared" / "fonts.json", made_from(bundle)):
        shutil.copytree(old / "prepared", target)
    else:
        target.mkdir()
        for name, data in prepared(bundle).items():
            (target / name).write_bytes(data)
    (bundle / "fonts" / "fonts.json").write_bytes(noted(bundle))


def is_from(listing: Path, digest: str) -> bool:
    """Whether there are files that were made from this."""
    try:
        return bool(json.loads(listing.read_bytes())["made_from"] == digest)
    except (OSError, ValueError, KeyError):
        return False


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:2]), Path(sys.argv[2]) if len(sys.argv) > 2 else None)
