"""Prints what of requirements.lock coursebuild needs, with the named extras and groups.

    python site/locked.py figures build > FILE && pip install --require-hashes -r FILE

It needs no package itself. All that the lock has is what extras and groups of all names need.
"""

import re
import sys
import tomllib
from collections.abc import Iterable, Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from coursebuild.core.files.resources import locked_requirements  # noqa: E402


def needs(names: Iterable[str] = (), folder: Path = ROOT) -> Iterator[str]:
    """The packages that a project needs with these extras and groups, itself or by one of ours."""
    text = tomllib.loads((folder / "pyproject.toml").read_text("utf-8"))
    project = text["project"]
    ours = text.get("tool", {}).get("uv", {}).get("sources", {})
    optional = project.get("optional-dependencies", {}) | text.get("dependency-groups", {})
    for line in (*project["dependencies"], *(line for name in names for line in optional[name])):
        package, extras = re.findall(r"^([\w.-]+)(?:\[([\w,-]+)\])?", line)[0]
        if package in ours:
            yield from needs(filter(None, extras.split(",")), folder / ours[package]["path"])
        else:
            yield package


if __name__ == "__main__":
    print(locked_requirements(needs(sys.argv[1:])), end="")
