"""A site of a few pages."""

from __future__ import annotations

from pathlib import Path

import pytest

from coursebuild.core.engine.manifest import MARKER
from coursebuild.core.engine.publish import publish
from coursebuild.core.model.results import CachedFile, SiteFile


class Pages:
    """Pages whose text is their key, and which were made."""

    def __init__(self) -> None:
        self.made_paths: list[str] = []

    def __call__(self, **keys: str) -> list[SiteFile]:
        """Files `a/b/c.html` are called `a__b__c`."""
        return [self.page(name.replace("__", "/") + ".html", key) for name, key in keys.items()]

    def page(self, path: str, key: str) -> CachedFile:
        def make() -> bytes:
            self.made_paths.append(path)
            return f"{path} {key}".encode()

        return CachedFile(path, key, make)


def texts(folder: Path) -> dict[str, str]:
    return {
        p.relative_to(folder).as_posix(): p.read_text(errors="replace")
        for p in folder.rglob("*")
        if p.is_file() and p.name != MARKER
    }


SITE_FILES = {"a": "1", "b__c": "1", "b__d": "1", "e__f__g": "1"}
TEXTS = {path: f"{path} 1" for path in ("a.html", "b/c.html", "b/d.html", "e/f/g.html")}


def entries(root: Path) -> list[str]:
    return sorted(p.name for p in root.iterdir() if p.name != ".coursebuild")


@pytest.fixture
def root(tmp_path: Path) -> Path:
    (tmp_path / "course/content").mkdir(parents=True)
    return tmp_path / "course"


@pytest.fixture
def pages() -> Pages:
    return Pages()


@pytest.fixture
def course(root: Path, pages: Pages) -> Path:
    """A course with a site of the files SITE_FILES."""
    publish(root, root / "public", pages(**SITE_FILES))
    pages.made_paths.clear()
    return root
