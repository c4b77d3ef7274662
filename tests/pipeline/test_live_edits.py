"""A course in memory gives the site that a build gives, whatever was edited before."""

from __future__ import annotations

import contextlib
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from support.edited_course import EDITS, WORDS, Course, Edit, breakage, plan, remove
from support.live_course import Builds, Live, differences
from support.scratch_course import Folder

IDS = ("1.1", "1.2", "1.3", "2.1")


class Preview:
    """A course in memory that is edited, and clean builds of its files."""

    def __init__(self, folder: Path, stores: Path) -> None:
        self.course = Course(Folder(folder / "course"))
        self.course.folder.borrow(stores)
        self.builds = Builds(folder, stores)
        self.live = Live(self.course.folder)
        self.close = self.live.close

    def save(self, edit: Edit, id: str, word: str) -> None:
        before = self.course.folder.tree()
        self.course.apply(edit, id, word)
        after = self.course.folder.tree()
        changed_paths = {path for path in before | after if before.get(path) != after.get(path)}
        self.live.save(*sorted(changed_paths))

    def is_right(self) -> bool:
        """Assert that the site is that of a clean build; return whether there is one."""
        build, site = self.builds(self.course.folder), self.live.site()
        assert (self.live.error_rules() == []) is (build is not None)
        assert build is None or differences(site, build) == []
        return build is not None


@pytest.mark.site
def test_after_an_edit_of_each_kind_it_is_what_a_clean_build_gives(
    tmp_path: Path, stores: Path
) -> None:
    with contextlib.closing(Preview(tmp_path, stores)) as preview:
        for number, edit in enumerate(EDITS):
            for _ in range(2 if edit in (plan, remove, breakage) else 1):  # and back again
                preview.save(edit, IDS[number % len(IDS)], WORDS[number % len(WORDS)])
            if number % 4 == 3:
                assert preview.is_right(), edit
        assert preview.is_right()


@pytest.mark.slow
@settings(max_examples=8)
@given(data=st.data())
def test_after_any_edits_it_is_what_a_clean_build_gives(
    data: st.DataObject, tmp_path_factory: pytest.TempPathFactory, stores: Path
) -> None:
    with contextlib.closing(Preview(tmp_path_factory.mktemp("live"), stores)) as preview:
        for _ in range(data.draw(st.integers(1, 4), label="rounds")):
            choice = st.tuples(st.sampled_from(EDITS), st.sampled_from(IDS), st.sampled_from(WORDS))
            for edit, id, word in data.draw(st.lists(choice, max_size=4), label="edits"):
                preview.save(edit, id, word)
                if data.draw(st.booleans(), label="all of it"):
                    preview.live.rebuild.run_once()
            preview.is_right()
