"""What an SVG may hold."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from coursebuild.core.drawing.safe_svg import read_svg, without_refused
from support.fixture_cases import fixture_tables
from support.hostile_svg import HARMLESS, HOSTILE, mutants

CASES = fixture_tables("safe_svg")

ROOT = Path(__file__).parents[3]
DRAWINGS = sorted(
    (*(ROOT / "content").rglob("*.svg"), *(ROOT / "tests/fixtures/drawings").glob("*.svg"))
)
SVG = '<svg xmlns="http://www.w3.org/2000/svg" xmlns:x="{}">\n{}</svg>'
NOTES = "http://www.inkscape.org/namespaces/inkscape"
UNHARMED = frozenset(("image of SVG as PNG", "100,000 namespaces", "CSS of 300,000 escapes"))
"""Files that may be shown: nothing comes of what they try."""

WORDINGS = {
    **dict(CASES["parts"]),
    "<g>" * 100: "contains more than 100 elements inside each other on line 2",
}


def test_each_reason_has_its_words() -> None:
    wordings = {inside: read_svg(SVG.format("urn:x", inside).encode()) for inside in WORDINGS}
    assert wordings == WORDINGS


@pytest.mark.long
def test_what_is_left_of_a_drawing_is_one_that_may_be_shown() -> None:
    for _, data in (*HOSTILE, *HARMLESS):
        left, parts = without_refused(data)
        assert left == data if not parts else not isinstance(read_svg(left), str)


WHOLE = {
    b"": "is not an SVG file: no element found: line 1, column 0",
    b"<p/>": "is not an SVG file: its root is another element",
    b"\xff\xfe<\0": "is not an SVG file in UTF-8",
    b"<?xml version='1.0' encoding='utf-7'?><svg/>": "is not in UTF-8, but in `utf-7`",
    b"<!DOCTYPE svg [<!ENTITY a 'a'>]>": "contains a document type of its own on line 1",
    b"x" * (5 << 20): "is larger than 4 MiB",
}


def test_each_reason_why_a_file_is_no_drawing_has_its_words() -> None:
    assert {data: read_svg(data) for data in WHOLE} == WHOLE


@pytest.mark.long
def test_hostile_files_are_refused_in_words() -> None:
    readings = {name: read_svg(data) for name, data in HOSTILE}
    assert {name for name, reading in readings.items() if not isinstance(reading, str)} == UNHARMED
    wordings = [reading for reading in readings.values() if isinstance(reading, str)]
    assert [
        wording for wording in wordings if not re.match("contains|is|draws|repeats", wording)
    ] == []
    assert max(map(len, wordings)) < 200


def test_what_only_looks_like_an_attack_is_shown() -> None:
    assert {name: r for name, data in HARMLESS if isinstance(r := read_svg(data), str)} == {}


def test_what_programs_draw_is_shown() -> None:
    faults = {
        file.name: r for file in DRAWINGS if isinstance(r := read_svg(file.read_bytes()), str)
    }
    assert faults == {}


def test_what_is_written_again_is_as_safe() -> None:
    """A drawing that passes also passes as the elements that were read of it."""
    count = 0
    for name, data in (*HARMLESS, *mutants(1_000, seed=0)):
        drawing = read_svg(data)
        if not isinstance(drawing, str):
            again = read_svg(ET.tostring(drawing, encoding="utf-8"))
            assert not isinstance(again, str), f"{name}: {again}"
            count += 1
    assert count > len(HARMLESS)
