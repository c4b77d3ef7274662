"""Reading a course, with everything that can lie in a folder."""

from __future__ import annotations

import errno
import os
from collections.abc import Mapping
from pathlib import Path

import pytest

from coursebuild.core.files.errors import EffectError, OutsideProjectError
from coursebuild.core.files.read import read_bytes, read_course

LESSON = "content/lessons/1.1-a.md"


@pytest.fixture
def root(tmp_path: Path) -> Path:
    root = tmp_path / "course"
    fill(root, {"content/course.toml": "[course]\n", "content/lessons/.keep": ""})
    return root


def fill(root: Path, files: Mapping[str, bytes | str]) -> None:
    for path, data in files.items():
        (root / path).parent.mkdir(parents=True, exist_ok=True)
        (root / path).write_bytes(data if isinstance(data, bytes) else data.encode())


def unreadable(root: Path) -> dict[str, str]:
    """The message for each path that cannot be read."""
    parsed_course = read_course(root)
    diagnostics = parsed_course.diagnostics
    assert all(d.rule == "file-unreadable" for d in diagnostics)
    assert sorted(parsed_course.value.unreadable) == sorted(d.span.path for d in diagnostics)
    return {d.span.path: d.message.removeprefix(f"{d.span.path} ") for d in diagnostics}


# --- what there is


def test_everything_in_its_place_and_sorted(root: Path, tmp_path: Path) -> None:
    lessons = ["1.1-a.md", "10.1-c.md", "2.1-b.md", "drafts/9.9-x.md"]
    pages = ["about.md", "more/deep.md"]
    models = ["box", "robots/arm"]
    files = {f"content/lessons/{name}": name for name in reversed(lessons)}
    files |= {f"content/pages/{name}": name for name in pages}
    files |= {f"models/{name}.xml": "<mujoco/>" for name in models}
    fill(root, files | {"content/lessons/pictures/p.png": "p", "models/robots/arm.stl": b"\xff"})
    (tmp_path / "link").symlink_to("course")
    for folder in (root, tmp_path / "link"):
        parsed_course = read_course(folder)
        course = parsed_course.value
        assert parsed_course.diagnostics == () and course.map is not None
        assert [s.path for s in course.lessons] == [f"content/lessons/{n}" for n in lessons]
        assert [s.path for s in course.pages] == [f"content/pages/{name}" for name in pages]
        model_paths = [(name, f"models/{name}.xml") for name in models]
        assert [(m.name, m.source.path) for m in course.models] == model_paths
        assert "content/lessons/pictures/p.png" in course.files
        assert list(course.files) == sorted(course.files)


def test_editors_droppings_are_no_files(root: Path) -> None:
    names = "1.1-a.md~", ".1.1-a.md.swp", "#1.1-a.md#", ".hidden.md", "4913~", "__pycache__/a.pyc"
    fill(root, {f"content/lessons/{name}": b"\xff" for name in names})
    (root / "content/lessons/.#1.1-a.md").symlink_to("author@host.1234:5678")
    parsed_course = read_course(root)
    assert (parsed_course.diagnostics, parsed_course.value.lessons) == ((), ())
    assert parsed_course.value.files == ("content/course.toml",)


def test_odd_names(root: Path) -> None:
    names = ["1 a b", "ünï-日本", "a\nb", "a'\"`$", "-rf", "a\\b", "a" * 250]
    fill(root, {f"content/lessons/{name}.md": name for name in names})
    parsed_course = read_course(root)
    assert parsed_course.diagnostics == ()
    assert {(s.path, s.text) for s in parsed_course.value.lessons} == {
        (f"content/lessons/{name}.md", name) for name in names
    }
    Path(os.fsdecode(os.fsencode(root) + b"/content/lessons/b\xff.md")).write_bytes(b"x")
    escaped_path = "content/lessons/b\\udcff.md"
    assert unreadable(root) == {escaped_path: "has a name that is not UTF-8"}


# --- text


def test_text_is_as_on_disk(root: Path) -> None:
    data = "\ufeffa\r\nb\rc\n\u2028d\x0c\x00e".encode()
    fill(root, {LESSON: data})
    (source,) = read_course(root).value.lessons
    assert source.text.encode() == data


INVALID_BYTES = [
    (b"ab\xe9c", 1, 3, "byte 0xe9 is not UTF-8"),
    ("é\r\n\U0001d4b3x".encode() + b"\xffz", 2, 3, "byte 0xff is not UTF-8"),
    (b"a\rb\r\n\xc3", 3, 1, "byte 0xc3 is not UTF-8"),
    (b"\xed\xa0\x80", 1, 1, "byte 0xed is not UTF-8"),
]
NO_TEXT = [
    ("hi".encode("utf-16"), 1, 1, "byte 0xff is not UTF-8"),
    ("\u4e00\u4e01".encode("utf-16"), 1, 1, "byte 0xff is not UTF-8"),
    (b"\x89PNG\r\n\x1a\n\0\0\0\x0d", 1, 1, "byte 0x89 is not UTF-8"),
    (b"x" * 5000 + b"\0\xff", 1, 5002, "byte 0xff is not UTF-8"),
]


def test_bytes_that_are_not_utf8_are_shown_and_what_is_no_text_is_read_no_further(
    root: Path,
) -> None:
    for data, line, column, message in (*INVALID_BYTES, *NO_TEXT):
        fill(root, {LESSON: data})
        parsed_course = read_course(root)
        [diagnostic] = parsed_course.diagnostics
        assert diagnostic.rule == "file-encoding"
        assert (diagnostic.span.line, diagnostic.span.column) == (line, column), data
        assert diagnostic.message == message, data
        assert diagnostic.help == "save the file as UTF-8", data
        files = parsed_course.value
        if (data, line, column, message) in NO_TEXT:
            assert (files.lessons, files.unreadable) == ((), (LESSON,)), data
            continue
        # The rest of the file is there for other stages, and can never be written back as it is.
        assert diagnostic.span.text == "\ufffd"
        (source,) = files.lessons
        assert source.text.encode() != data


# --- what cannot be read


def test_links_lead_nowhere_but_into_the_project(root: Path, tmp_path: Path) -> None:
    fill(tmp_path, {"secret.md": "secret", "elsewhere/x": ""})
    shared = {"shared/text.md": "shared", "shared/m/a.xml": "<mujoco/>"}
    fill(root, {**shared, "content/pages/x.md": ""})
    links = {
        "content/lessons/1.2-b.md": "../../../secret.md",
        "content/lessons/1.3-c.md": str(tmp_path / "secret.md"),
        "content/pages/sub": "../../..",
        "models": "../elsewhere",
    }
    for path, target in (links | {LESSON: "../../shared/text.md"}).items():
        (root / path).symlink_to(target)
    out = "is reached through a link that leads out of the project"
    assert unreadable(root) == dict.fromkeys(links, out)
    for path in links:
        (root / path).unlink()
    (root / "models").mkdir()
    (root / "models/m").symlink_to("../shared/m")
    (root / "models/m/loop").symlink_to("..")
    parsed_course = read_course(root)
    assert parsed_course.diagnostics == ()
    assert [s.text for s in parsed_course.value.lessons] == ["shared"]
    assert [m.name for m in parsed_course.value.models] == ["m/a"]


def test_few_links_that_make_endless_paths(root: Path) -> None:
    for number in range(11):  # two ways from each folder to the next
        folder = root / f"content/{number:02}"
        folder.mkdir()
        for way in ("a", "b") if number < 10 else ():
            (folder / way).symlink_to(f"../{number + 1:02}")
    fill(root, {f"content/10/{number}.png": "x" for number in range(30)} | {LESSON: "x"})
    parsed_course = read_course(root)
    course = parsed_course.value
    assert [d.rule for d in parsed_course.diagnostics] == ["file-unreadable"]
    assert [source.path for source in course.lessons] == [LESSON]
    assert f"content/00/{'a/' * 10}7.png" in course.files
    assert "content/10/29.png" in course.files  # no link leads there, as its own name does


def test_folders_in_folders(root: Path) -> None:
    path = f"content/{'a/' * 495}x.png"
    fill(root, {path: "x"})
    assert path in read_course(root).value.files


def test_things_that_are_no_files(root: Path) -> None:
    fill(root, {f"{LESSON}/x": "", "content/lessons/z.md": "z"})
    os.mkfifo(root / "content/lessons/1.2-b.md")
    (root / "content/lessons/1.3-c.md").symlink_to("nowhere")
    (root / "content/lessons/1.4-d.md").symlink_to("1.4-d.md")
    (root / "models").touch()
    assert unreadable(root) == {
        LESSON: "is a folder",
        "content/lessons/1.2-b.md": "is not a regular file",
        "content/lessons/1.3-c.md": "is a link to a file that is not there",
        "content/lessons/1.4-d.md": f"cannot be read: {os.strerror(errno.ELOOP).lower()}",
        "models": "is not a folder",
    }


def test_files_of_holes(root: Path) -> None:
    for path in (LESSON, "models/a.xml"):
        fill(root, {path: ""})
        os.truncate(root / path, 1 << 41)
    assert set(unreadable(root).values()) == {"cannot be read: it is larger than 1,024 MiB"}


def test_refused_by_the_system(root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fill(root, {LESSON: "a", "content/lessons/1.2-b.md": "b"})
    really = os.open

    def refuse(path: Path, *rest: int) -> int:
        if str(path).endswith("1.1-a.md"):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(path))
        return really(path, *rest)

    monkeypatch.setattr(os, "open", refuse)
    assert unreadable(root) == {LESSON: "cannot be read: permission denied"}


def test_bytes_of_a_file_of_the_course_and_of_no_other(root: Path, tmp_path: Path) -> None:
    fill(root, {"content/p.png": b"\x00\xff\r\n"})
    assert read_bytes(root, "content/p.png") == b"\x00\xff\r\n"
    (tmp_path / "secret").touch()
    (root / "link").symlink_to("../secret")
    os.mkfifo(root / "fifo")
    for path in ("../secret", "/etc/passwd", "content/../../secret", "link"):
        with pytest.raises(OutsideProjectError):
            read_bytes(root, path)
    for path in ("content/none", "content", "content/a\0b", "fifo"):
        with pytest.raises(EffectError):
            read_bytes(root, path)
