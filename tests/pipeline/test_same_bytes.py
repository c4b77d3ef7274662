"""The same course gives the same site, byte for byte, wherever and however it is built."""

from __future__ import annotations

import io
import sys
import zipfile
from pathlib import Path

import pytest

from support.built_sites import BuiltCourses, course_copy
from support.live_course import TRIALS, differences
from support.scratch_course import ROOT, Folder

pytestmark = pytest.mark.engine

FULL = ROOT / "tests/courses/full/course"


@pytest.fixture(scope="module")
def original(built_courses: BuiltCourses) -> Folder:
    """The course that uses everything, built in a process of the tests."""
    return built_courses["full"]


def test_build_elsewhere_in_another_environment_gives_the_same_bytes(
    original: Folder, tmp_path: Path, stores: Path
) -> None:
    """With the stored results of labs; the next test runs labs again."""
    folder = course_copy("full", tmp_path / "anderswo ünd 別" / "a course", stores)
    for name in TRIALS:
        (folder.root / ".coursebuild" / name).symlink_to(original.root / ".coursebuild" / name)
    environment = {
        "TZ": "Pacific/Kiritimati",
        "LANG": "tr_TR.UTF-8",
        "LC_ALL": "C",
        "PYTHONHASHSEED": "4242",
        "PYTHONOPTIMIZE": "2",
        "SOURCE_DATE_EPOCH": "1",
        "USER": "somebody",
    }
    root = str(folder.root)
    result = folder.run(
        "-C", root, "build", "--jobs", "3", "--quiet", cwd=tmp_path, env=environment
    )
    assert result.status == 0, result.out
    assert differences(original.tree(), folder.tree()) == []


@pytest.mark.slow
def test_build_without_caches_and_with_files_in_another_order_gives_the_same_bytes(
    original: Folder, tmp_path: Path
) -> None:
    """Fonts are cut again, and the files of folders are created in reverse order."""
    root = tmp_path / "reverse"
    for path in sorted(FULL.rglob("*"), reverse=True):
        if path.is_file():
            target = root / path.relative_to(FULL)
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(path.read_bytes())
            target.chmod(0o600)
    folder = Folder(root)
    folder.tmp.mkdir()
    result = folder.run("build", env={"PYTHONHASHSEED": "1"})
    assert result.status == 0, result.out
    assert differences(original.tree(), folder.tree()) == []


def test_nothing_in_a_site_says_where_it_was_built(original: Folder) -> None:
    places = [str(place).encode() for place in (original.root.parent, ROOT, sys.prefix)]
    for name, data in original.tree("public").items():
        texts = [data]
        if name.endswith(".zip"):
            with zipfile.ZipFile(io.BytesIO(data)) as archive:
                texts += [archive.read(member) for member in archive.namelist()]
        assert not [place for place in places if any(place in text for text in texts)], name
