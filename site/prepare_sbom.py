"""Writes the wheel's bill of materials in CycloneDX: the packages in it, and those that it needs.

    python site/prepare_sbom.py FILE

`site/bundle.py` calls it with a file beside the licences that it has gathered: nothing of a package
without a licence file is in the wheel. Python packages are not in the wheel; the bill names the
versions of requirements.lock, with which it was tested.
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

from locked import locked_requirements, needs

SITE = Path(__file__).resolve().parent


def bundled_packages(licences: Path) -> Iterator[dict[str, Any]]:
    """The packages of npm's lock that are in the wheel, at least in part."""
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


def python_packages() -> Iterator[dict[str, Any]]:
    """The Python packages, as they are locked."""
    lock = locked_requirements(needs())
    for name, version in re.findall(r"^([\w-]+)==([\w.]+)", lock, re.MULTILINE):
        yield {**_component("pypi", name, version), "isExternal": True}


def _component(kind: str, name: str, version: str) -> dict[str, Any]:
    url = f"pkg:{kind}/{quote(name)}@{version}"
    return {"type": "library", "bom-ref": url, "name": name, "version": version, "purl": url}


def main(file: Path) -> None:
    """Write the bill of materials."""
    project = tomllib.loads((SITE.parent / "pyproject.toml").read_text("utf-8"))["project"]
    wheel = _component("pypi", project["name"], project["version"])
    components = [*bundled_packages(file.parent / "licences"), *python_packages()]
    needs = {
        "ref": wheel["bom-ref"],
        "dependsOn": [c["bom-ref"] for c in components],
    }
    bill = {
        "bomFormat": "CycloneDX",
        "specVersion": "1.7",
        "version": 1,
        "metadata": {"component": {**wheel, "licenses": [{"expression": project["license"]}]}},
        "components": components,
        "dependencies": [needs],
    }
    file.write_text(json.dumps(bill, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
