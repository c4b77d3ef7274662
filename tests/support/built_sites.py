"""Courses that are built once for all processes of a test run, and sites of them on a host."""

from __future__ import annotations

import contextlib
import fcntl
import os
import re
import shutil
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from support.scratch_course import ROOT, Folder, command
from support.static_host import Host

_KIND = re.compile(rb'<body class="on-([a-z-]+)"')


_BASES = {"full": "/constructs/", "nasty": "/c/", "arabic": "/c/"}
"""The paths of the base addresses in the courses' maps."""


@dataclass(frozen=True, slots=True)
class Site:
    """A built course and its host."""

    root: Path
    host: Host

    @property
    def public(self) -> Path:
        return self.root / "public"

    def pages(self) -> list[str]:
        paths = self.public.rglob("*.html")
        return sorted(path.relative_to(self.public).as_posix() for path in paths)

    def kinds(self) -> dict[str, str]:
        """Return the largest page of each kind, which has most in it."""
        largest: dict[str, str] = {}
        for path in sorted(self.pages(), key=lambda path: (self.public / path).stat().st_size):
            largest[self.kind(path)] = path
        return largest

    def unlike_pages(self) -> list[str]:
        """Return all pages, but of kinds that are only a template and a few words the largest."""
        largest = self.kinds().values()
        alike = ("stub", "level")
        return [path for path in self.pages() if self.kind(path) not in alike or path in largest]

    def kind(self, path: str) -> str:
        match = _KIND.search((self.public / path).read_bytes())
        assert match is not None, path
        return match[1].decode()

    def url(self, path: str = "") -> str:
        return self.host.url + path.removesuffix("index.html")


@dataclass(frozen=True, slots=True)
class BuiltCourses:
    """Courses in a folder that all processes of a run share; the first that needs one builds it."""

    shared: Path
    stores: Path

    def __getitem__(self, name: str) -> Folder:
        """Return the course of a folder in tests/courses, or this repository's as `real`."""
        folder = Folder(ROOT if name == "real" else self.shared / name / "a course")
        marker = self.shared / name / "done"
        with _locked(self.shared / name):
            if not marker.exists():
                if name == "real":
                    _build_real()
                else:
                    shutil.rmtree(folder.root, ignore_errors=True)
                    course = course_copy(name, folder.root, self.stores)
                    course.main("build", "--quiet").require_success()
                marker.touch()
        return folder


class Sites(dict[str, Site]):
    """The courses in `tests/courses`, and the `real` one, built and served on first use."""

    def __init__(self, courses: BuiltCourses) -> None:
        super().__init__()
        self._courses = courses

    def __missing__(self, name: str) -> Site:
        folder = self._courses[name]
        self[name] = Site(folder.root, Host(folder.root / "public", _BASES.get(name, "/")))
        return self[name]


def course_copy(name: str, root: Path, stores: Path) -> Folder:
    folder = Folder(Path(shutil.copytree(ROOT / "tests/courses" / name / "course", root)))
    folder.borrow(stores)
    return folder


def _build_real() -> None:
    """Build as `make site` does, with the key of the user, so that what it has made is believed."""
    inner = {name: value for name, value in os.environ.items() if name != "XDG_STATE_HOME"}
    outer = {name.removeprefix("OUTER_"): value for name, value in inner.items()}
    result = subprocess.run(
        command("build", "--quiet"), cwd=ROOT, env=outer, capture_output=True, text=True
    )
    assert result.returncode == 0, result.stdout + result.stderr


@contextlib.contextmanager
def _locked(folder: Path) -> Iterator[None]:
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield
