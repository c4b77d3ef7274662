"""Scripts run again when a file that they looked at is another, also while they run."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest
from msgspec.structs import replace

from coursebuild.core.model.results import Outcome, Trace
from support.fake_runs import JOB, LOOKED, PATH, Desk


@pytest.fixture
def desk(tmp_path: Path) -> Desk:
    return Desk(tmp_path / "course")


def test_a_file_that_changes_and_changes_back(desk: Desk) -> None:
    """Each state has its result, and a state that was seen before needs no run."""
    desk.run(LOOKED, stdout="one\n")
    desk.write("models/a.xml", b"<mujoco model='b'/>")
    assert desk.recall() is None
    desk.settle()
    desk.run(LOOKED, stdout="two\n")
    found = desk.recall()
    assert found is not None and found.stdout == "two\n"
    desk.write("models/a.xml", b"<mujoco/>")
    found = desk.recall()
    assert found is not None and found.stdout == "one\n"


def test_the_touch_of_a_file_and_of_others_is_nothing(desk: Desk) -> None:
    desk.run(LOOKED)
    os.utime(desk.root / "models/a.xml")
    desk.write("models/other.xml", b"x")
    desk.write("content/lessons/1.1-a.md", b"prose")
    assert desk.recall() is not None


def test_a_file_of_the_same_size_and_time_is_another(desk: Desk) -> None:
    path = desk.root / "models/a.xml"
    status = path.stat()
    desk.run(LOOKED)
    assert desk.recall() is not None
    path.write_bytes(b"<mujacu/>")
    os.utime(path, ns=(status.st_atime_ns, status.st_mtime_ns))
    assert desk.recall() is None


def test_a_file_that_appears_or_goes_or_becomes_a_folder(desk: Desk) -> None:
    desk.run(LOOKED)
    desk.write("models/none.xml", b"x")
    assert desk.recall() is None
    (desk.root / "models/none.xml").unlink()
    assert desk.recall() is not None
    (desk.root / "models/none.xml").mkdir()
    assert desk.recall() is None
    (desk.root / "models/none.xml").rmdir()
    (desk.root / "models/a.xml").unlink()
    assert desk.recall() is None
    (desk.root / "models/a.xml").mkdir()
    assert desk.recall() is None
    shutil.rmtree(desk.root / "models")
    (desk.root / "models").write_text("a file where the folder was")
    assert desk.recall() is None


def test_a_link_that_leads_elsewhere(desk: Desk) -> None:
    desk.write("models/b.xml", b"<mujoco model='b'/>")
    link = desk.root / "models/link.xml"
    link.symlink_to("a.xml")
    desk.settle()
    desk.run(Trace(("models/link.xml",), (), (), (), ""))
    assert desk.recall() is not None
    link.unlink()
    link.symlink_to("b.xml")
    assert desk.recall() is None


def test_names_that_are_no_text(desk: Desk) -> None:
    name = os.fsdecode(b"models/\xff.bin")
    desk.write(name, b"1")
    desk.settle()
    desk.run(Trace((name,), (), (), (), ""))
    assert desk.recall() is not None
    desk.write(name, b"2")
    assert desk.recall() is None


def test_upper_and_lower_case_are_two_files(desk: Desk) -> None:
    desk.run(Trace(("models/A.xml",), (), (), (), ""))
    assert desk.recall() is not None
    desk.write("models/A.xml", b"x")
    assert desk.recall() is None


def test_a_listed_folder(desk: Desk) -> None:
    desk.run(Trace((), ("models",), (), (), ""))
    desk.write("models/a.xml", b"other content")
    assert desk.recall() is not None
    desk.write("models/b.xml", b"one more")
    assert desk.recall() is None


def test_a_file_outside_of_the_course(desk: Desk, tmp_path: Path) -> None:
    outside = tmp_path / "outside.txt"
    outside.write_text("1")
    desk.settle()
    desk.run(Trace((), (), (str(outside),), (), ""))
    assert desk.recall() is not None
    outside.write_text("2")
    assert desk.recall() is None


def test_a_course_that_is_moved(desk: Desk, tmp_path: Path) -> None:
    desk.run(LOOKED, outcome=Outcome.FAILED, status=1, stderr=f'File "{desk.root}/examples/a.py"\n')
    desk.root.rename(tmp_path / "moved")
    desk.root = tmp_path / "moved"
    found = desk.recall()
    assert found is not None
    assert found.stderr == f'File "{tmp_path}/moved/examples/a.py"\n'


def test_a_moved_course_runs_what_printed_its_place(desk: Desk, tmp_path: Path) -> None:
    desk.run(stdout=f"reading {desk.root}/models/a.xml\n")
    assert desk.recall() is not None
    desk.root.rename(tmp_path / "moved")
    desk.root = tmp_path / "moved"
    assert desk.recall() is None


def test_a_module_that_changed_or_is_there_now(
    desk: Desk, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "site-packages"
    folder.mkdir()
    monkeypatch.syspath_prepend(folder)
    (folder / "wobble.py").write_text("SIZE = 1\n")
    needing = replace(JOB, requires=("nowhere_at_all",))
    trace = Trace((), (), (), ("wobble",), "")
    desk.run(trace, needing)
    assert desk.recall(needing) is not None
    (folder / "wobble.py").write_text("SIZE = 200\n")
    assert desk.recall(needing) is None
    desk.run(trace, needing)
    assert desk.recall(needing) is not None
    (folder / "nowhere_at_all.py").write_text("")
    assert desk.recall(needing) is None


def test_a_file_saved_while_the_script_ran(desk: Desk) -> None:
    desk.run(LOOKED, during=lambda: desk.write("models/a.xml", b"saved"))
    assert desk.why() == "models/a.xml changed while it ran"
    assert desk.recall() is None


def test_a_file_that_went_and_came_while_the_script_ran(desk: Desk) -> None:
    def blink() -> None:
        desk.write("models/none.xml", b"x")
        (desk.root / "models/none.xml").unlink()

    desk.run(LOOKED, during=blink)
    assert desk.why() == "models/none.xml changed while it ran"


def test_a_script_edited_while_it_ran(desk: Desk) -> None:
    desk.run(during=lambda: desk.write(PATH, b"print('other')\n"))
    assert desk.why() == "its file changed while it ran"
    assert desk.recall() is None


def test_a_file_made_beside_the_script_while_it_ran(desk: Desk) -> None:
    """By another script: only one with the name of a module that this one imports would count."""
    sought = tuple(f"examples/{name}" for name in ("json.py", "json/__init__.py"))
    trace = Trace(sought, (), (), (), "")
    desk.run(trace, during=lambda: desk.write("examples/picture.png", b"x"))
    assert desk.recall() is not None
    desk.write("examples/json.py", b"x")
    assert desk.recall() is None


def test_something_else_saved_while_the_script_ran(desk: Desk) -> None:
    desk.run(LOOKED, during=lambda: desk.write("content/lessons/1.1-a.md", b"prose"))
    assert desk.recall() is not None


def test_a_file_of_the_future(desk: Desk) -> None:
    """Its time of content is set to be in the future, as unpacked archives have it."""
    os.utime(desk.root / "models/a.xml", (4_000_000_000, 4_000_000_000))
    desk.settle()
    desk.run(LOOKED)
    assert desk.recall() is not None
