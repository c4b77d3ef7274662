"""The data in files of figures: they come back as they were, and hostile ones are none."""

from __future__ import annotations

import io
import zlib

import msgspec
import pytest
from PIL import Image

from coursebuild.core.scripts.figure_data import (
    MOST_DATA,
    Axes,
    DrawnPart,
    FigureData,
    png_chunk,
    read_figure_data,
    without_data,
)
from coursebuild.core.scripts.figures import describe_difference, prepare_figure

NOTHING = ("",)


def figure_data(y: float = 2.0, words: str = "a <b> & “c”", font: str = "Sans.ttf") -> FigureData:
    part = DrawnPart(
        "curve", words, {"color": ["#000000ff"]}, paths=(((0.0, 0.0), (1.0, y), (None, None)),)
    )
    axes = Axes(
        kind="rectilinear",
        titles=NOTHING,
        labels=("t", ""),
        scales=("linear", "linear"),
        limits=((0.0, 1.0), (0.0, 4.0)),
        inverted=(False, False),
        ticks=((), ()),
        ranges=(1.0, 4.0),
        legend=(),
        parts=(part,),
    )
    return FigureData((6.4, 4.8), (font,), (), (), (axes,))


def svg(data: FigureData | str | None, width: int = 9) -> bytes:
    text = msgspec.json.encode(data).decode() if isinstance(data, FigureData) else data or ""
    text = text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
    element = f'<metadata class="drawn">{text}</metadata>' if text else ""
    path = f'<path d="M0 0h{width}"/>'
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 9 9">{path}{element}</svg>'.encode()
    )


def png(chunk: bytes = b"", shade: int = 0) -> bytes:
    data = io.BytesIO()
    Image.new("L", (5, 5), shade).save(data, "PNG")
    head, end, tail = data.getvalue().rpartition(b"\0\0\0\0IEND")
    return head + chunk + end + tail


def prepared(name: str, data: bytes) -> bytes:
    figure = prepare_figure(name, data)
    assert isinstance(figure, bytes), figure
    return figure


FILES = (("x.svg", svg(figure_data())), ("x.png", png(png_chunk(figure_data()))))


@pytest.mark.parametrize(("name", "file"), FILES)
def test_data_are_recorded_with_the_drawing(name: str, file: bytes) -> None:
    recorded = prepared(name, file)
    assert read_figure_data(recorded) == figure_data()
    assert prepared(name, recorded) == recorded
    bare = without_data(recorded)
    assert read_figure_data(bare) is None
    assert prepared(name, bare) == bare and without_data(bare) == bare


DRAWN_ANEW = {
    "x.svg": (svg(figure_data(), 2), svg(figure_data(3), 2), svg(figure_data(font="Mono.ttf"), 2)),
    "x.png": tuple(
        png(png_chunk(data), 255)
        for data in (figure_data(), figure_data(3), figure_data(font="Mono.ttf"))
    ),
}


@pytest.mark.parametrize(("name", "file"), FILES)
def test_drawing_is_compared_only_where_it_must_be_the_same(name: str, file: bytes) -> None:
    old = prepared(name, file)
    shift, data_change, font_change = (prepared(name, data) for data in DRAWN_ANEW[name])
    assert describe_difference(name, old, shift) != ""
    assert describe_difference(name, old, shift, is_same_place=False) == ""
    assert describe_difference(name, old, font_change) == "", "its letters have other sizes"
    wording = "has its point 2 of 3 at (1, 3) where (1, 2) is recorded"
    assert wording in describe_difference(name, old, data_change)
    assert wording in describe_difference(name, old, data_change, is_same_place=False)


def test_drawings_of_which_one_has_no_data_are_compared_as_drawings() -> None:
    base, copy, shift = (prepared("x.svg", svg(None, width)) for width in (9, 9, 2))
    with_data = prepared("x.svg", svg(figure_data()))
    for is_same_place in (True, False):
        assert describe_difference("x.svg", copy, with_data, is_same_place=is_same_place) == ""
        assert "moved" in describe_difference("x.svg", shift, base, is_same_place=is_same_place)
        assert "moved" in describe_difference(
            "x.svg", shift, with_data, is_same_place=is_same_place
        )


def chunk(data: bytes) -> bytes:
    body = b"zTXtdrawn\0\0" + data
    return (len(body) - 4).to_bytes(4, "big") + body + zlib.crc32(body).to_bytes(4, "big")


HOSTILE = (
    svg("no JSON"),
    svg('{"size": [1, 2]}'),
    svg("[" * 100_000),
    svg(figure_data()).replace(b"9.0", b"NaN").replace(b'"size":[6.4', b'"size":[NaN'),
    png(chunk(zlib.compress(b" " * (50 * MOST_DATA)))),
    png(chunk(b"not compressed")),
    png(chunk(zlib.compress(b"\xff{}"))),
    png() + b"zTXtdrawn\0\0",
    b"zTXtdrawn\0\0",
)


def test_what_are_no_data_counts_as_none() -> None:
    assert [data for data in HOSTILE if read_figure_data(data) is not None] == []
    for data in HOSTILE:
        without_data(data)
