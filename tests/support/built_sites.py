"""What the tests of standards share: two built courses, and every kind of page in them.

One is the course of this repository, the other has every construct of the lesson format. Which
pages there are is found out from the built sites, so that a new kind of page is tested as soon as
there is one.
"""

from __future__ import annotations

import fcntl
import os
import re
import shutil
from dataclasses import dataclass
from pathlib import Path

import pytest

from support.scratch_course import ROOT, Folder
from support.static_host import Host

_KIND = re.compile(rb'<body class="on-([a-z-]+)"')


@dataclass(frozen=True, slots=True)
class Site:
    """A built course and its host."""

    name: str
    root: Path
    host: Host

    @property
    def public(self) -> Path:
        return self.root / "public"

    def pages(self) -> list[str]:
        """The site paths of all pages."""
        found = self.public.rglob("*.html")
        return sorted(path.relative_to(self.public).as_posix() for path in found)

    def kinds(self) -> dict[str, str]:
        """Of each kind of page the largest, which has most to it."""
        found: dict[str, str] = {}
        for path in sorted(self.pages(), key=lambda path: (self.public / path).stat().st_size):
            found[self.kind(path)] = path
        return found

    def kind(self, path: str) -> str:
        match = _KIND.search((self.public / path).read_bytes())
        assert match is not None, path
        return match[1].decode()

    def url(self, path: str) -> str:
        return self.host.url + path.removesuffix("index.html")


def build_both(shared: Path, stores: Path) -> dict[str, Path]:
    """Build the two courses, once for all processes that run tests."""
    shared.mkdir(exist_ok=True)
    roots = {name: shared / name for name in ("real", "full")}
    with (shared / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not (shared / "done").exists():
            for name, root in roots.items():
                shutil.rmtree(root, ignore_errors=True)
                origin = ROOT if name == "real" else ROOT / "tests/courses/full/course"
                for part in ("content", "models", "docs"):
                    if (origin / part).is_dir():
                        shutil.copytree(origin / part, root / part)
                folder = Folder(root)
                folder.borrow(stores)
                done = folder.main("build")
                assert done.status == 0, done.out + done.err
            (shared / "done").touch()
    return roots


def shared_folder(factory: pytest.TempPathFactory) -> Path:
    base = factory.getbasetemp()
    return (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / "standards"
