"""Positions count as each client does, whatever characters and line ends a text has."""

from __future__ import annotations

from pathlib import Path

import pytest
from lsprotocol.types import Position

from coursebuild.core.text.source import Source
from coursebuild.features.language_server.commands.texts import Places

TEXT = "α\r\nä𝄞b\u2028c\rlast 🙂"
"""A line separator of Unicode ends no line, as it ends none of CommonMark's."""


@pytest.mark.parametrize(
    ("encoding", "b", "end"),
    [("utf-8", (1, 6), (2, 9)), ("utf-16", (1, 3), (2, 7)), ("utf-32", (1, 2), (2, 6))],
)
def test_positions_of_each_encoding(
    encoding: str, b: tuple[int, int], end: tuple[int, int]
) -> None:
    places, source = Places(Path("/course")), Source("a.md", TEXT)
    places.encoding = encoding
    for offset, (line, character) in ((TEXT.index("b"), b), (len(TEXT), end)):
        assert places.position(source, offset) == Position(line, character)
        assert places.offset(source, Position(line, character)) == offset


def test_a_position_that_is_not_there_is_the_nearest() -> None:
    places, source = Places(Path("/course")), Source("a.md", TEXT)
    assert places.offset(source, Position(1, 2)) == TEXT.index("𝄞")  # between its halves
    assert places.offset(source, Position(1, 99)) == TEXT.index("\rlast")
    assert places.offset(source, Position(99, 0)) == len(TEXT)


def test_files_of_the_course_are_known_by_any_name(tmp_path: Path) -> None:
    root, link = tmp_path / "a cöurse", tmp_path / "link"
    (root / "content").mkdir(parents=True)
    link.symlink_to(root)
    places = Places(root)
    uri = f"{link.as_uri()}/content/x.md"
    assert places.path(uri) == "content/x.md"
    assert places.uri("content/x.md") == uri  # as the editor writes it
    assert places.path((tmp_path / "x.md").as_uri()) == places.path("untitled:Untitled-1") == ""
