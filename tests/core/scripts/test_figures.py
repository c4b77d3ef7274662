"""Figures as they are recorded, and how two of them differ."""

from __future__ import annotations

import io

from PIL import Image
from PIL.PngImagePlugin import PngInfo

from coursebuild.core.scripts.figures import describe_difference, prepare_figure

SVG = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {}">{}</svg>'


def svg(inside: str, size: str = "100 50") -> bytes:
    return SVG.format(size, inside).encode()


def recorded(inside: str) -> bytes:
    figure_file = prepare_figure("x.svg", svg(inside))
    assert isinstance(figure_file, bytes), figure_file
    return figure_file


def png(size: tuple[int, int] = (20, 10), spots: dict[tuple[int, int], int] | None = None) -> bytes:
    image = Image.new("L", size, 255)
    for place, value in (spots or {}).items():
        image.putpixel(place, value)
    data = io.BytesIO()
    image.save(data, "PNG")
    return data.getvalue()


def test_what_changes_from_run_to_run_is_not_recorded() -> None:
    today = recorded(
        '<!-- made today --><metadata>2026-11-22</metadata><defs><path id="m4f2a" d="M0 0"/></defs>'
        '<use href="#m4f2a"/><g clip-path="url(#p1)"/><clipPath id="p1"/>'
    )
    later = recorded(
        '<!-- made later --><metadata>2027-01-01</metadata><defs><path id="m9c1b" d="M0 0"/></defs>'
        '<use href="#m9c1b"/><g clip-path="url(#p7)"/><clipPath id="p7"/>'
    )
    assert today == later
    assert b"20" not in today.replace(b"2000/svg", b"") and b"made" not in today


DIFFERENT = {
    '<path d="M0 0L10.05 1"/>': "",
    '<path d="M0 0L12.5 1"/>': "1 of its parts moved, by up to 2.5% of its size",
    '<path d="M0 0L10 1" fill="red"/>': "it has 7 parts where 6 are recorded",
    '<path d="M0 0H10 1"/>': "other words or colours in 1 of its parts",
    '<path d="M0 0L1e999 1"/>': "1 of its parts moved, by up to inf% of its size",
    '<path d="M0 0L10 1"/><text>a</text>': "it has 8 parts where 6 are recorded",
}


def test_svg_differs_by_parts_words_and_places() -> None:
    base = recorded('<path d="M0 0L10 1"/>')
    wordings = {
        inside: describe_difference("x.svg", base, recorded(inside)) for inside in DIFFERENT
    }
    assert wordings == DIFFERENT


def test_png_differs_by_pixels() -> None:
    base = png()
    assert describe_difference("x.png", base, png(spots={(3, 3): 254})) == ""
    wording = describe_difference("x.png", base, png(spots={(3, 4): 0, (7, 8): 0}))
    assert wording == "pixels differ in columns 3 to 8, rows 4 to 9"
    wording = describe_difference("x.png", base, png((10, 10)))
    assert wording == "it has 10×10 pixels where 20×10 are recorded"
    assert describe_difference("x.png", b"no", base) == "the recorded file is not a PNG file"


DIFFERENT_TABLES = {
    b"time,x\n0,1.0004\n1,nan\n": "",
    b"time,x\n0,1.002\n1,nan\n": "1 of its cells differ",
    b"time,y\n0,1\n1,2\n": "2 of its cells differ",
    b"time,x\n0,1\n": "the table has other rows or columns",
}


def test_data_differ_by_cells() -> None:
    base = prepare_figure("x.csv", b"time,x\r\n0,1.0\r\n1,nan\r\n")
    assert base == b"time,x\n0,1.0\n1,nan\n"
    wordings = {table: describe_difference("x.csv", base, table) for table in DIFFERENT_TABLES}
    assert wordings == DIFFERENT_TABLES


def test_ids_are_renamed_wherever_they_are_named() -> None:
    drawing = recorded(
        "<style>#deep > .a, #b1{fill: #b1b1b1} .c{fill: url( '#b1' )}</style>"
        '<g id="deep" aria-labelledby="b1 deep"><path id="b1"/></g>'
        '<g style="mask: url(#deep)"/>'
    )
    assert b"<style>#x1 &gt; .a, #x2{fill: #b1b1b1} .c{fill: url( '#x2' )}</style>" in drawing
    assert b'id="x1" aria-labelledby="x2 x1"' in drawing and b"mask: url(#x1)" in drawing


def test_of_a_png_what_is_drawn_is_recorded() -> None:
    text = PngInfo()
    text.add_text("Author", "somebody", zip=True)
    data = io.BytesIO()
    frames = [Image.new("L", (5, 5), shade) for shade in (0, 100, 200)]
    frames[0].save(data, "PNG", pnginfo=text, save_all=True, append_images=frames[1:])
    figure_file = prepare_figure("x.png", data.getvalue() + b"<script>f()</script>")
    assert isinstance(figure_file, bytes)
    assert not any(part in figure_file for part in (b"zTXt", b"fdAT", b"script"))
    assert describe_difference("x.png", data.getvalue(), figure_file) == ""


def test_reasons_why_a_figure_cannot_be_shown() -> None:
    wordings = [
        prepare_figure(name, data)
        for name, data in (
            ("x.svg", svg("<script/>")),
            ("x.png", png()[:50]),
            ("x.png", b""),
            ("x.png", png()[:16] + b"\x7f\xff\xff\xff" * 2 + png()[24:]),
            ("x.csv", b"1," * (3 << 20)),
        )
    ]
    assert wordings == [
        "contains `<script>` on line 1",
        "is not a PNG file",
        "is not a PNG file",
        "has more than 25 million pixels",
        "is larger than 4 MiB",
    ]


def test_tables_that_nobody_can_read_are_told() -> None:
    long, text = b"1" * 200_000 + b"x\n", b'"' + b"a" * 200_000
    wording = describe_difference("x.csv", b"1\n", long)
    assert wording == "a table cannot be read: field larger than field limit (131072)"
    assert describe_difference("x.csv", text, b"1\n") == wording
