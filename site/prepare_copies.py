"""Compresses the files that pages of every course use: see `coursebuild/core/files/resources.py`.

    python site/prepare_copies.py FOLDER

`site/bundle.py` calls it with the bundle that it makes. The engine of the labs is not compressed:
its copies would be a third of the package.
"""

import json
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from coursebuild.core.files.resources import template_texts
from coursebuild.core.model.results import OutputFile
from coursebuild.core.pages.assets import SCRIPTS, compressed_files, page_script

LABS = ("js/lab.js", "js/lab-worker.js")


def compress(bundle: Path) -> dict[str, bytes]:
    """The compressed files by name, and a list of their names by key."""
    originals = {name: page_script((bundle / file).read_bytes()) for name, file in SCRIPTS.items()}
    originals |= {file.removeprefix("js/"): (bundle / file).read_bytes() for file in LABS}
    originals["icon.svg"] = dict(template_texts())["icon.svg"].encode()
    files: dict[str, bytes] = {}
    names_by_key: dict[str, str] = {}
    for name, data in originals.items():
        for copy in compressed_files([OutputFile(f"assets/{name}", data)], lambda _, make: make()):
            names_by_key[copy.key] = copy.path.removeprefix("assets/")
            files[names_by_key[copy.key]] = copy.make()
    text = json.dumps(names_by_key, indent=1, sort_keys=True)
    return {**files, "copies.json": f"{text}\n".encode()}


def main(bundle: Path) -> None:
    """Write the compressed files into a bundle."""
    for name, data in compress(bundle).items():
        (bundle / "prepared" / name).write_bytes(data)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
