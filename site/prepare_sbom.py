"""Writes the wheel's bill of materials in CycloneDX: what it holds of others, and what it asks for.

    python site/prepare_sbom.py FILE

`site/bundle.py` calls it with a file beside the licences that it has gathered: of a package without
one, nothing is in the wheel. Python's packages are not in it; the versions that it was tested with
are those of requirements.txt.
"""

import base64
import json
import re
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import quote

SITE = Path(__file__).resolve().parent


def bundled(licences: Path) -> Iterator[dict[str, Any]]:
    """The packages of npm's lock of which something is in the wheel."""
    lock = json.loads((SITE / "package-lock.json").read_text("utf-8"))["packages"]
    for path, package in lock.items():
        name = path.removeprefix("node_modules/")
        if not (licences / f"{name.replace('@', '').replace('/', '-')}.txt").is_file():
            continue
        digest = base64.b64decode(package["integrity"].removeprefix("sha512-"))
        yield {
            **_component("npm", name, package["version"]),
            "hashes": [{"alg": "SHA-512", "content": digest.hex()}],
            "licenses": [{"expression": package["license"]}],
        }


def installed_beside() -> Iterator[dict[str, Any]]:
    """Python's packages, as they are locked."""
    lock = (SITE.parent / "requirements.txt").read_text("utf-8")
    for name, version in re.findall(r"^([\w-]+)==([\w.]+)", lock, re.MULTILINE):
        yield {**_component("pypi", name, version), "isExternal": True}


def _component(kind: str, name: str, version: str) -> dict[str, Any]:
    url = f"pkg:{kind}/{quote(name)}@{version}"
    return {"type": "library", "bom-ref": url, "name": name, "version": version, "purl": url}


def main(file: Path) -> None:
    """Write it."""
    project = tomllib.loads((SITE.parent / "pyproject.toml").read_text("utf-8"))["project"]
    about = _component("pypi", project["name"], project["version"])
    components = [*bundled(file.parent / "licences"), *installed_beside()]
    needs = {"ref": about["bom-ref"], "dependsOn": [one["bom-ref"] for one in components]}
    bill = {
        "bomFormat": "CycloneDX",
        "specVersion": "1.7",
        "version": 1,
        "metadata": {"component": {**about, "licenses": [{"expression": project["license"]}]}},
        "components": components,
        "dependencies": [needs],
    }
    file.write_text(json.dumps(bill, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
