"""After any edits, and with any number of processes, the site is that of a clean build."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from support.edited_course import EDITS, LESSON, NORUN, WORDS, Course, plan, remove, retitle, turn
from support.scratch_course import Folder

pytestmark = pytest.mark.site


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory, stores: Path) -> Folder:
    """The course before any edit, with its site."""
    folder = Folder(tmp_path_factory.mktemp("built") / "course")
    Course(folder)
    folder.borrow(stores)
    assert folder.main("build", "--quiet").status == 0
    return folder


@given(
    st.lists(
        st.tuples(
            st.sampled_from(EDITS),
            st.sampled_from(["1.1", "1.2", "1.3", "2.1", "2.2"]),
            st.sampled_from(WORDS),
            st.booleans(),
        ),
        min_size=1,
        max_size=7,
    )
)
@settings(max_examples=8)
def test_after_any_edits_the_site_is_that_of_a_clean_checkout(
    built: Folder,
    stores: Path,
    edits: list[tuple[Callable[[Course, str, str], None], str, str, bool]],
) -> None:
    with tempfile.TemporaryDirectory() as scratch:
        folder = Folder(Path(scratch).resolve() / "edited")
        shutil.copytree(built.root, folder.root, symlinks=True)
        folder.tmp.mkdir()
        course = Course(folder)
        for edit, id, word, build in edits:
            if (folder.root / course.path(id)).exists() or edit in (plan, remove, turn, retitle):
                edit(course, id, word)
                course.save()
            if build:
                folder.main("build", "--quiet")
        status = folder.main("build", "--quiet").status
        clean = Folder(folder.root.with_name("clean"))
        for top in ("content", "models"):
            shutil.copytree(folder.root / top, clean.root / top)
        clean.borrow(stores)
        assert clean.main("build", "--quiet").status == status
        if status == 0:
            assert differing(folder, clean) == []


def differing(a: Folder, b: Folder) -> list[str]:
    left, right = a.tree("public"), b.tree("public")
    return sorted(path for path in left.keys() | right.keys() if left.get(path) != right.get(path))


def test_copies_of_the_process_give_what_one_gives(tmp_path: Path, stores: Path) -> None:
    """Few lessons are read here and drawn in copies; many are read there, too."""
    for last in (8, 21):
        sites = []
        for jobs in ("1", "3"):
            folder = Folder(tmp_path / f"{last} lessons, jobs {jobs}")
            course = Course(folder)
            for n in range(6, last + 1):
                id = f"1.{n}"
                course.ids.append(id)
                course.titles[id] = f"Title {n}"
                course.write(id, LESSON.format(n=n, next="1.1", script=NORUN.format(n=n)))
            course.save()
            folder.borrow(stores)
            done = folder.run("build", "--quiet", "--jobs", jobs)
            assert (done.status, done.out, done.err) == (0, "", "")
            sites.append(folder.tree("public"))
        assert sites[0] == sites[1], last
