"""A run with nothing to do: it must know that nothing changed, and never believe it wrongly."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from coursebuild.effects import stamp
from coursebuild.effects.stamp import State, Watcher, unchanged

COMMAND = ("build", "public")
AGO = 3_600_000_000_000
"""ns."""


def age(folder: Path) -> None:
    """Let everything be an hour old, at times that no coarse clock gives."""
    for path in (folder, *folder.rglob("*")):
        if not path.is_symlink():
            then = time.time_ns() - AGO
            os.utime(path, ns=(then, then - then % 1_000_000 + 123_457))


@pytest.fixture
def root(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    root = tmp_path / "course"
    for path in ("content/lessons/1.1-a.md", "content/course.toml", "models/m.xml", "data/d.csv"):
        (root / path).parent.mkdir(parents=True, exist_ok=True)
        (root / path).write_text(path)
    for path in ("public/index.html", "examples/a.py"):
        (root / path).parent.mkdir(parents=True)
        (root / path).write_text(path)
    (tmp_path / "site-packages/numpy-2.0.dist-info").mkdir(parents=True)
    monkeypatch.setattr(sys, "path", [str(tmp_path / "site-packages")])
    age(root)
    return root


def keep(root: Path, said: str = "all is well\n") -> bool:
    watcher = Watcher(str(root), COMMAND)
    return watcher.keep(said, ["data/d.csv", "data/not-there.csv"], ["public", "examples"])


def said(root: Path) -> str | None:
    return unchanged(str(root), COMMAND)


@pytest.mark.parametrize("text", ["all is well\n", "", "é\n\nwarning: x\n", "\n\n\n", "\udc80\n"])
def test_what_was_said_is_said_again(root: Path, text: str) -> None:
    assert said(root) is None
    assert keep(root, text)
    assert said(root) == text
    assert said(root) == text


def test_each_command_has_its_own(root: Path) -> None:
    assert keep(root)
    assert unchanged(str(root), ("build", "elsewhere")) is None
    assert unchanged(str(root), ("build",)) is None
    assert unchanged(str(root), ("buildpublic",)) is None


def rewrite(path: str) -> Callable[[Path], None]:
    def change(root: Path) -> None:
        before = (root / path).read_bytes()
        (root / path).write_bytes(before[:-1] + b"!")  # as long as it was

    return change


def touch(root: Path) -> None:
    os.utime(root / "content/course.toml")


def add(root: Path) -> None:
    (root / "content/lessons/1.2-b.md").touch()


def add_folder(root: Path) -> None:
    (root / "content/new").mkdir()


def remove(root: Path) -> None:
    (root / "models/m.xml").unlink()


def rename(root: Path) -> None:
    (root / "content/lessons/1.1-a.md").rename(root / "content/lessons/1.1-b.md")


def appear(root: Path) -> None:
    (root / "data/not-there.csv").touch()


def vanish(root: Path) -> None:
    (root / "data/d.csv").unlink()


def replace(root: Path) -> None:
    """Another file with the same name, size and time."""
    file = root / "models/m.xml"
    status = file.stat()
    (root / "models/new").write_bytes(file.read_bytes())
    os.utime(root / "models/new", ns=(status.st_atime_ns, status.st_mtime_ns))
    (root / "models/new").replace(file)


def install(root: Path) -> None:
    packages = root.parent / "site-packages"
    (packages / "numpy-2.0.dist-info").rename(packages / "numpy-2.1.dist-info")


def site_gone(root: Path) -> None:
    (root / "public").rename(root / "elsewhere")


def foreign(root: Path) -> None:
    (root / "public/note.txt").touch()


def file_for_folder(root: Path) -> None:
    (root / "examples/a.py").unlink()
    (root / "examples/a.py").mkdir()


CHANGES = [
    *(rewrite(p) for p in ("content/lessons/1.1-a.md", "models/m.xml", "data/d.csv")),
    *(rewrite(p) for p in ("public/index.html", "examples/a.py")),
    *(touch, add, add_folder, remove, rename, appear, vanish, replace, install, site_gone),
    *(foreign, file_for_folder),
]


@pytest.mark.parametrize("change", CHANGES)
def test_any_change_is_seen(root: Path, change: Callable[[Path], None]) -> None:
    assert keep(root)
    change(root)
    assert said(root) is None


@pytest.mark.parametrize(("name", "value"), [("MUJOCO_GL", "osmesa"), ("PYTHONPATH", "/elsewhere")])
def test_what_decides_which_code_runs_is_seen(
    root: Path, monkeypatch: pytest.MonkeyPatch, name: str, value: str
) -> None:
    assert keep(root)
    monkeypatch.setenv(name, value)
    assert said(root) is None


def test_another_python_is_seen(root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert keep(root)
    monkeypatch.setattr(sys, "version", "3.99.0")
    assert said(root) is None


def test_what_is_no_part_of_the_course_is_not_looked_at(root: Path) -> None:
    assert keep(root)
    for name in (".1.1-a.md.swp", "1.1-a.md~"):
        (root / "content/lessons" / name).touch()
    (root / "content/__pycache__").mkdir()
    (root / "README.md").touch()
    (root / ".git").mkdir()
    assert said(root) == "all is well\n"


@pytest.mark.parametrize("change", [add, remove, rewrite("models/m.xml")])
def test_what_changes_during_the_work_leaves_no_stamp(
    root: Path, change: Callable[[Path], None]
) -> None:
    watcher = Watcher(str(root), COMMAND)
    change(root)
    assert not watcher.keep("all is well\n", [], ["public"])
    assert said(root) is None


def test_a_file_read_by_a_script_that_changes_during_the_work_leaves_no_stamp(root: Path) -> None:
    watcher = Watcher(str(root), COMMAND)
    (root / "data/d.csv").write_text("other")
    assert not watcher.keep("all is well\n", ["data/d.csv"], ["public"])


def test_what_the_work_writes_may_be_new(root: Path) -> None:
    watcher = Watcher(str(root), COMMAND)
    (root / "public/index.html").write_text("new")
    assert watcher.keep("all is well\n", [], ["public"])
    assert said(root) == "all is well\n"


def states(folder: Path) -> list[State]:
    """What a command that wrote these files knows of them."""
    found = [(p, p.lstat()) for p in folder.rglob("*") if not p.is_dir()]
    return [
        (p.relative_to(folder).as_posix(), s.st_mode, s.st_size, s.st_mtime_ns, s.st_ino)
        for p, s in reversed(found)
    ]


NAMES = st.text("ab.~é -\U00010400", min_size=1, max_size=3).filter(lambda n: n not in (".", ".."))


@pytest.mark.site
@given(paths=st.sets(st.lists(NAMES, min_size=1, max_size=4).map("/".join), max_size=12))
def test_what_is_known_of_a_folder_is_what_is_seen_there(paths: set[str]) -> None:
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        for path in [*paths, "__pycache__/a", "a/__pycache__/b/c"]:
            file = folder / path
            if not any(p.is_file() for p in file.parents) and not file.exists():
                file.parent.mkdir(parents=True, exist_ok=True)
                file.write_text(path)
        for given_as in (made, f"{made}/"):
            assert [*stamp._known(given_as, states(folder))] == [*stamp._found(given_as, None)]


@pytest.mark.parametrize("out", ["public", "public/", "a/b", "../elsewhere"])
def test_what_the_work_knows_of_its_files_need_not_be_looked_at(
    root: Path, monkeypatch: pytest.MonkeyPatch, out: str
) -> None:
    for path in ("a.html", "a/b.html", "a-b/c.html", ".hidden", "z/.hidden/d"):
        (root / out / path).parent.mkdir(parents=True, exist_ok=True)
        (root / out / path).write_text(path)
    assert keep_all(root, out)
    [file] = (root / ".coursebuild/unchanged").iterdir()
    looked = file.read_bytes()
    file.unlink()
    with monkeypatch.context() as patch:
        known, really = {out: states(root / out)}, stamp._found
        patch.setattr(
            stamp,
            "_found",
            lambda path, began, **how: (
                pytest.fail(path) if path.endswith(out) else really(path, began, **how)
            ),
        )
        assert Watcher(str(root), COMMAND).keep("all is well\n", [], [out], known)
    assert file.read_bytes() == looked
    assert said(root) == "all is well\n"


def keep_all(root: Path, out: str) -> bool:
    return Watcher(str(root), COMMAND).keep("all is well\n", [], [out])


@pytest.mark.parametrize("change", ["rewrite", "add", "remove", "chmod"])
def test_what_is_changed_once_it_was_written_is_seen(root: Path, change: str) -> None:
    """Even before there is a stamp."""
    watcher, known = Watcher(str(root), COMMAND), {"public": states(root / "public")}
    file = root / "public/index.html"
    if change == "rewrite":
        file.write_text("other")
    elif change == "add":
        (root / "public/more.html").write_text("more")
    elif change == "remove":
        file.unlink()
    else:
        file.chmod(0o600)
    assert watcher.keep("all is well\n", [], ["public"], known)
    assert said(root) is None


@pytest.mark.parametrize(
    ("before", "coarse", "kept"),
    [
        (60_000_000, False, True),
        (10_000_000, False, False),
        (-10_000_000_000, False, False),
        (1_000_000_000, True, False),
        (3_000_000_000, True, True),
    ],
)
def test_a_file_whose_time_says_nothing_leaves_no_stamp(
    root: Path, before: int, coarse: bool, kept: bool
) -> None:
    """Changed just before the work began, or where the clock is coarse, or in the future."""
    now = time.time_ns()
    then = now - before
    then = then - then % 1_000_000 + (0 if coarse else 123_457)
    os.utime(root / "models/m.xml", ns=(then, then))
    watcher = Watcher.__new__(Watcher)
    watcher.root, watcher.command, watcher.began = str(root), COMMAND, now
    watcher.before = watcher._look()
    assert watcher.keep("all is well\n", [], []) is kept


def test_a_linked_folder_leaves_no_stamp(root: Path) -> None:
    """What changes behind it is not looked at."""
    (root / "content/linked").symlink_to(root / "data")
    assert not keep(root)


def test_a_link_to_a_file_is_followed(root: Path) -> None:
    (root / "content/linked.csv").symlink_to(root / "data/other.csv")
    assert keep(root)  # also one that leads nowhere
    (root / "data/other.csv").write_text("1")
    assert said(root) is None
    age(root)
    assert keep(root)
    (root / "data/other.csv").write_text("2")
    assert said(root) is None


@pytest.mark.parametrize("at", range(0, 300, 11))
def test_a_damaged_stamp_is_not_believed(root: Path, at: int) -> None:
    assert keep(root)
    [file] = (root / ".coursebuild/unchanged").iterdir()
    data = bytearray(file.read_bytes())
    data[at % len(data)] ^= 4
    file.write_bytes(data)
    assert said(root) is None
    file.write_bytes(data[: at % len(data)])
    assert said(root) is None


def test_a_stamp_that_cannot_be_written_costs_only_time(root: Path) -> None:
    (root / ".coursebuild").write_text("in the way")
    assert not keep(root)
    assert said(root) is None


def test_a_name_that_would_not_fit_a_line_leaves_no_stamp(root: Path) -> None:
    assert not Watcher(str(root), COMMAND).keep("all is well\n", ["data/a\nb"], [])


def test_looking_imports_next_to_nothing() -> None:
    code = (
        "import sys; import coursebuild.cli, coursebuild.effects.stamp, coursebuild.effects.place\n"
        "print(sorted(m for m in sys.modules if m.startswith('coursebuild.')))\n"
        "large = {'argparse', 'collections', 'contextlib', 'hashlib', 'pathlib', 're', 'typing'}\n"
        "print(sorted(large & set(sys.modules)))\n"
    )
    done = subprocess.run(
        [sys.executable, "-S", "-c", code],
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, "PYTHONPATH": str(Path(stamp.__file__).parents[2])},
    )
    assert done.stdout.splitlines() == [
        "['coursebuild.cli', 'coursebuild.cli.output', 'coursebuild.cli.unchanged', "
        "'coursebuild.effects', "
        "'coursebuild.effects.place', 'coursebuild.effects.stamp']",
        "[]",
    ]


def test_a_stamp_of_another_format_is_none(root: Path) -> None:
    assert keep(root)
    (path,) = (root / ".coursebuild/unchanged").iterdir()
    body = path.read_bytes().partition(b"\n")[2].replace(b"coursebuild stamp 3", b"other", 1)
    for text in (body, b"coursebuild stamp 1\nabc\n\nsaid"):
        path.write_bytes(stamp._digest(text) + b"\n" + text)
        assert unchanged(str(root), COMMAND) is None
