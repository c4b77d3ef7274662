"""Which files a site has: no more and no fewer than it lists."""

from __future__ import annotations

from pathlib import Path

import pytest

from coursebuild.effects.site_listing import MARKER, foreign_files, holds, marker

PATHS = ("a.html", "b/c.html", "b/\u00e9.html")


@pytest.fixture
def site(tmp_path: Path) -> Path:
    for path in PATHS:
        (tmp_path / path).parent.mkdir(exist_ok=True)
        (tmp_path / path).write_text(path)
    (tmp_path / MARKER).write_bytes(marker(PATHS))
    return tmp_path


def test_all_files_and_no_others(site: Path) -> None:
    assert holds(site, PATHS)
    assert not holds(site, PATHS[:2])
    assert not holds(site, (*PATHS, "d.html"))
    assert foreign_files(site) == []


def test_what_file_managers_leave_does_not_matter(site: Path) -> None:
    (site / "b/.DS_Store").touch()
    assert holds(site, PATHS)
    assert holds(site, (*PATHS, "b/Thumbs.db"))  # nor whether a site has such a file
    assert foreign_files(site) == []


def test_a_file_system_that_takes_letters_apart(site: Path) -> None:
    (site / "b/\u00e9.html").rename(site / "b/e\u0301.html")
    assert holds(site, PATHS)
    assert foreign_files(site) == []


@pytest.mark.parametrize("path", ["d.html", "b/d.html", "d/e/f"])
def test_a_file_more(site: Path, path: str) -> None:
    (site / path).parent.mkdir(parents=True, exist_ok=True)
    (site / path).touch()
    assert not holds(site, PATHS)
    assert foreign_files(site) == [path]


@pytest.mark.parametrize("path", [*PATHS, MARKER])
def test_a_file_less(site: Path, path: str) -> None:
    (site / path).unlink()
    assert not holds(site, PATHS)
    assert foreign_files(site) == ([] if path != MARKER else sorted(PATHS))


def test_a_site_that_is_not_there(tmp_path: Path) -> None:
    assert foreign_files(tmp_path / "none") == []
