"""Reading a course, with everything that can lie in a folder."""

from __future__ import annotations

import errno
import os
from collections.abc import Callable
from pathlib import Path

import pytest

from coursebuild.core.files.errors import EffectError, OutsideProjectError
from coursebuild.core.files.read import read_bytes, read_course

Tree = dict[str, bytes | str]


@pytest.fixture
def course(tmp_path: Path) -> Callable[[Tree], Path]:
    def make(files: Tree) -> Path:
        root = tmp_path / "course"
        for path, data in ({"content/course.toml": "[course]\n"} | files).items():
            target = root / path
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(data if isinstance(data, bytes) else data.encode())
        return root

    return make


def complaints(root: Path) -> list[tuple[str, str, int, int, str]]:
    return [
        (d.rule, d.span.path, d.span.line, d.span.column, d.message)
        for d in read_course(root).diagnostics
    ]


class TestListing:
    def test_everything_in_its_place_and_sorted(self, course: Callable[[Tree], Path]) -> None:
        root = course(
            {
                "content/lessons/2.1-b.md": "b",
                "content/lessons/10.1-c.md": "c",
                "content/lessons/1.1-a.md": "a",
                "content/lessons/pictures/p.png": b"\x89PNG",
                "content/lessons/drafts/9.9-x.md": "what no map can name",
                "content/pages/about.md": "p",
                "content/pages/more/deep.md": "q",
                "models/box.xml": "<mujoco/>",
                "models/robots/arm.xml": "<mujoco/>",
                "models/robots/arm.stl": b"\xff\xfe",
            }
        )
        found = read_course(root)
        assert found.diagnostics == ()
        assert [s.path for s in found.value.lessons] == [
            "content/lessons/1.1-a.md",
            "content/lessons/10.1-c.md",
            "content/lessons/2.1-b.md",
            "content/lessons/drafts/9.9-x.md",
        ]
        assert [s.path for s in found.value.pages] == [
            "content/pages/about.md",
            "content/pages/more/deep.md",
        ]
        assert [(m.name, m.source.path) for m in found.value.models] == [
            ("box", "models/box.xml"),
            ("robots/arm", "models/robots/arm.xml"),
        ]
        assert found.value.map is not None
        assert "content/lessons/pictures/p.png" in found.value.files
        assert list(found.value.files) == sorted(found.value.files)

    def test_editors_droppings_are_no_files(self, course: Callable[[Tree], Path]) -> None:
        root = course(
            {
                f"content/lessons/{name}": b"\xff"
                for name in (
                    *("1.1-a.md~", ".1.1-a.md.swp", "#1.1-a.md#", ".hidden.md", "4913~"),
                    "__pycache__/made.cpython-311.pyc",
                )
            }
        )
        (root / "content/lessons/.#1.1-a.md").symlink_to("author@host.1234:5678")
        found = read_course(root)
        assert found.diagnostics == ()
        assert found.value.lessons == ()
        assert found.value.files == ("content/course.toml",)

    @pytest.mark.parametrize(
        "name",
        ["1 a b.md", "ünï-日本.md", "a\nb.md", "a'\"`$.md", "-rf.md", "a\\b.md", "a" * 250 + ".md"],
    )
    def test_odd_names(self, course: Callable[[Tree], Path], name: str) -> None:
        root = course({f"content/lessons/{name}": "text"})
        found = read_course(root)
        assert [(s.path, s.text) for s in found.value.lessons] == [
            (f"content/lessons/{name}", "text")
        ]
        assert found.diagnostics == ()

    def test_name_that_is_not_utf8(self, course: Callable[[Tree], Path]) -> None:
        root = course({})
        (root / "content/lessons").mkdir()
        Path(os.fsdecode(os.fsencode(root) + b"/content/lessons/a\xff.md")).write_bytes(b"x")
        (rule, path, *_, message) = complaints(root)[0]
        assert (rule, path) == ("file-unreadable", "content/lessons/a\\udcff.md")
        assert message == f"{path} has a name that is not UTF-8"
        path.encode()

    def test_missing_map(self, tmp_path: Path) -> None:
        assert complaints(tmp_path) == [
            ("map-missing", "content/course.toml", 1, 1, "there is no content/course.toml")
        ]
        assert read_course(tmp_path).value.map is None


class TestText:
    def test_text_is_as_on_disk(self, course: Callable[[Tree], Path]) -> None:
        data = "\ufeffa\r\nb\rc\n\u2028d\x0c\x00e".encode()
        root = course({"content/lessons/1.1-a.md": data})
        (source,) = read_course(root).value.lessons
        assert source.text.encode() == data

    @pytest.mark.parametrize(
        ("data", "line", "column", "message", "help"),
        [
            (b"ab\xe9c", 1, 3, "byte 0xe9 is not UTF-8", "Latin-1"),
            ("é\r\n\U0001d4b3x".encode() + b"\xffz", 2, 3, "byte 0xff is not UTF-8", "Latin-1"),
            (b"a\rb\r\n\xc3", 3, 1, "byte 0xc3 is not UTF-8", "Latin-1"),
            (b"\xed\xa0\x80", 1, 1, "byte 0xed is not UTF-8", "Latin-1"),
        ],
    )
    def test_bytes_that_are_not_utf8(
        self,
        course: Callable[[Tree], Path],
        data: bytes,
        line: int,
        column: int,
        message: str,
        help: str,
    ) -> None:
        root = course({"content/lessons/1.1-a.md": data, "models/m.xml": "<mujoco/>"})
        found = read_course(root)
        (diagnostic,) = found.diagnostics
        assert diagnostic.rule == "file-encoding"
        assert (diagnostic.span.line, diagnostic.span.column) == (line, column)
        assert diagnostic.span.text == "\ufffd"
        assert diagnostic.message == message
        assert help in diagnostic.help
        # The rest of the file is there for other stages, and can never be written back as it is.
        (source,) = found.value.lessons
        assert source.text.encode() != data

    @pytest.mark.parametrize(
        ("data", "line", "column", "message", "help"),
        [
            ("hi".encode("utf-16"), 1, 1, "byte 0xff is not UTF-8", "UTF-16"),
            ("\u4e00\u4e01".encode("utf-16"), 1, 1, "byte 0xff is not UTF-8", "UTF-16"),
            ("## Hi \u2014 you".encode("utf-16-le"), 1, 2, "byte 0x00 is not text", "UTF-16"),
            ("## Hi \u2014 you".encode("utf-16-be"), 1, 1, "byte 0x00 is not text", "UTF-16"),
            (b"\x89PNG\r\n\x1a\n\0\0\0\x0d", 1, 1, "byte 0x89 is not UTF-8", "a binary file"),
            (b"\x7fELF\x02\x00\x00\xff", 1, 8, "byte 0xff is not UTF-8", "a binary file"),
            (b"## A\n\nx\0y\0\n", 3, 2, "byte 0x00 is not text", "a binary file"),
            (bytes(4096), 1, 1, "byte 0x00 is not text", "a binary file"),
            (b"x" * 5000 + b"\0\xff", 1, 5002, "byte 0xff is not UTF-8", "a binary file"),
        ],
    )
    def test_what_is_no_text_is_read_no_further(
        self,
        course: Callable[[Tree], Path],
        data: bytes,
        line: int,
        column: int,
        message: str,
        help: str,
    ) -> None:
        root = course({"content/lessons/1.1-a.md": data, "content/pages/b.md": data})
        found = read_course(root)
        assert [d.rule for d in found.diagnostics] == ["file-encoding"] * 2
        diagnostic = found.diagnostics[0]
        assert (diagnostic.span.line, diagnostic.span.column) == (line, column)
        assert diagnostic.message == message
        assert diagnostic.help == f"save the file as UTF-8; it looks like {help}"
        assert (found.value.lessons, found.value.pages) == ((), ())
        assert found.value.unreadable == ("content/lessons/1.1-a.md", "content/pages/b.md")


class TestUnreadable:
    def unreadable(self, root: Path) -> list[tuple[str, str]]:
        found = read_course(root)
        assert all(d.rule == "file-unreadable" for d in found.diagnostics)
        assert sorted(found.value.unreadable) == sorted(d.span.path for d in found.diagnostics)
        return [(d.span.path, d.message) for d in found.diagnostics]

    def test_links_out_of_the_project(self, course: Callable[[Tree], Path], tmp_path: Path) -> None:
        root = course({"content/lessons/1.1-a.md": "a", "content/pages/x.md": ""})
        (tmp_path / "secret.md").write_text("secret")
        (tmp_path / "elsewhere").mkdir()
        (root / "content/lessons/1.2-b.md").symlink_to(tmp_path / "secret.md")
        (root / "content/lessons/1.3-c.md").symlink_to("../../../secret.md")
        (root / "models").symlink_to(tmp_path / "elsewhere")
        (root / "content/pages/sub").symlink_to("../../..")
        out = "is reached through a link that leads out of the project"
        assert sorted(self.unreadable(root)) == [
            (path, f"{path} {out}")
            for path in (
                "content/lessons/1.2-b.md",
                "content/lessons/1.3-c.md",
                "content/pages/sub",
                "models",
            )
        ]

    def test_links_inside_the_project_are_followed(self, course: Callable[[Tree], Path]) -> None:
        root = course(
            {"shared/text.md": "shared", "shared/m/a.xml": "<mujoco/>", "models/b.xml": ""}
        )
        (root / "content/lessons").mkdir()
        (root / "content/lessons/1.1-a.md").symlink_to("../../shared/text.md")
        (root / "models/m").symlink_to("../shared/m")
        (root / "models/m/loop").symlink_to("..")
        found = read_course(root)
        assert found.diagnostics == ()
        assert [s.text for s in found.value.lessons] == ["shared"]
        assert [m.name for m in found.value.models] == ["b", "m/a"]

    def test_project_reached_through_a_link(
        self, course: Callable[[Tree], Path], tmp_path: Path
    ) -> None:
        course({"content/lessons/1.1-a.md": "a"})
        (tmp_path / "link").symlink_to("course")
        found = read_course(tmp_path / "link")
        assert found.diagnostics == ()
        assert [s.path for s in found.value.lessons] == ["content/lessons/1.1-a.md"]

    def test_things_that_are_no_files(self, course: Callable[[Tree], Path]) -> None:
        root = course({"content/lessons/1.1-a.md/x": "", "content/lessons/z.md": "z"})
        os.mkfifo(root / "content/lessons/1.2-b.md")
        (root / "content/lessons/1.3-c.md").symlink_to("nowhere")
        (root / "content/lessons/1.4-d.md").symlink_to("1.4-d.md")
        loop = os.strerror(errno.ELOOP).lower()
        assert self.unreadable(root) == [
            (path, f"{path} {why}")
            for path, why in [
                ("content/lessons/1.1-a.md", "is a folder"),
                ("content/lessons/1.2-b.md", "is not a regular file"),
                ("content/lessons/1.3-c.md", "is a link to a file that is not there"),
                ("content/lessons/1.4-d.md", f"cannot be read: {loop}"),
            ]
        ]

    def test_refused_by_the_system(
        self, course: Callable[[Tree], Path], monkeypatch: pytest.MonkeyPatch
    ) -> None:
        root = course({"content/lessons/1.1-a.md": "a", "content/lessons/1.2-b.md": "b"})
        really = os.open

        def refuse(path: Path, *rest: int) -> int:
            if str(path).endswith("1.1-a.md"):
                raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(path))
            return really(path, *rest)

        monkeypatch.setattr(os, "open", refuse)
        path = "content/lessons/1.1-a.md"
        assert self.unreadable(root) == [(path, f"{path} cannot be read: permission denied")]

    def test_course_folder_is_a_file(self, tmp_path: Path) -> None:
        (tmp_path / "content").touch()
        found = read_course(tmp_path)
        assert ("content", "content is not a folder") in [
            (d.span.path, d.message) for d in found.diagnostics
        ]


class TestReadBytes:
    def test_bytes(self, course: Callable[[Tree], Path]) -> None:
        root = course({"content/p.png": b"\x00\xff\r\n"})
        assert read_bytes(root, "content/p.png") == b"\x00\xff\r\n"

    @pytest.mark.parametrize("path", ["../secret", "/etc/passwd", "content/../../secret", "link"])
    def test_outside(self, course: Callable[[Tree], Path], tmp_path: Path, path: str) -> None:
        root = course({})
        (tmp_path / "secret").touch()
        (root / "link").symlink_to("../secret")
        with pytest.raises(OutsideProjectError):
            read_bytes(root, path)

    @pytest.mark.parametrize("path", ["content/none", "content", "content/a\0b", "fifo"])
    def test_unreadable(self, course: Callable[[Tree], Path], path: str) -> None:
        root = course({})
        os.mkfifo(root / "fifo")
        with pytest.raises(EffectError):
            read_bytes(root, path)
