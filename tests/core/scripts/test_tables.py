"""Recorded tables and figures: how they are compared with what was printed, and updated."""

from __future__ import annotations

import io
import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec.structs import replace
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from coursebuild.core.model import Comparison, Filter, Table, Words
from coursebuild.core.model.results import Verdict
from coursebuild.core.scripts.compare import compare
from coursebuild.core.scripts.edit import update_body
from coursebuild.core.scripts.figures import describe_difference, prepare_figure
from coursebuild.core.scripts.printed_text import PrintedText
from coursebuild.core.text.diagnostics import Diagnostic, Edit
from support.fixture_cases import fixture_tables, fixture_text
from support.sample_lessons import DIGITS, EXACT, VOLATILE, table, tolerance, update

CASES = fixture_tables("tables")

OUTPUT = fixture_text("documents/table_output.txt")
HEAD = "| integrator | energy | momentum |\n| --- | ---: | ---: |\n"
ROWS = """\
| RK4 | −0.000 % | 3.9e-11 |
| `Euler` | **+6.641 %** | 6.9e-04 |
| implicitfast | −6.040 % | 6.4e-04 |
| implicit | -6.040  % | 6.4e-04 kg m^2/s |"""


def verdict(
    rows: str,
    printed: str = OUTPUT,
    comparison: Comparison = EXACT,
    filters: tuple[Filter, ...] = (),
) -> Verdict:
    comparison = replace(comparison, course_filters=filters)
    return compare(table(HEAD + rows), comparison, printed)


MODES = {"exact": EXACT, "digits": DIGITS, "tolerance": tolerance("0.1"), "volatile": VOLATILE}


def test_rows_stand_in_lines_with_whole_words_and_numbers() -> None:
    assert verdict(ROWS).status == "verified"
    for row, mode, status in CASES["rows"]:
        assert verdict(row, comparison=MODES[mode]).status == status, row


def test_a_table_is_the_lines_and_columns_that_its_header_names() -> None:
    for printed, titles, rows, reading, *left_out in CASES["tables"]:
        lines = [titles, re.sub("[^|]+", "---", titles), *rows.split("\n")]
        result = compare(table("\n".join(f"| {line} |" for line in lines)), EXACT, printed)
        row_count, printed_count = result.rows
        status = "undecided" if result.rivals and not result.changes else result.status
        assert (status, max(0, printed_count - row_count)) == (reading, sum(left_out)), lines


def test_the_number_that_drifted_is_named() -> None:
    result = verdict(ROWS.replace("6.641", "6.702"))
    (change,) = result.changes
    assert (change.kind.value, change.recorded, change.printed) == ("numeric", "+6.702", "+6.641")
    assert change.span.text == "+6.702"


def test_the_nearest_of_several_numbers_is_compared() -> None:
    (change,) = verdict("| Euler | | 6.8e-04 |").changes
    assert (change.recorded, change.printed) == ("6.8e-04", "6.9e-04")


def test_a_row_without_a_line_is_missing() -> None:
    (change,) = verdict(ROWS.replace("`Euler`", "`Midpoint`")).changes
    assert change.kind.value == "missing lines"
    assert change.recorded == "Midpoint +6.641 % 6.9e-04".replace(" +", "  +").replace("% ", "%  ")
    assert change.span.text == "`Midpoint` | **+6.641 %** | 6.9e-04"


def test_filters_apply_to_cells_and_lines() -> None:
    printed = "run 17: took 3.25 s, E 1.5\nrun 18: took 9.99 s, E 2.5\n"
    seconds = Filter(r"\d+\.\d+ s", "… s")
    rows = "| run 17 | took 1.00 s | 1.5 |\n| run 18 | took … s | 2.6 |"
    (change,) = verdict(rows, printed, EXACT, (seconds,)).changes
    assert (change.recorded, change.printed, change.span.text) == ("2.6", "2.5", "2.6")


def test_a_large_table() -> None:
    rows = "\n".join(f"| p{i} | {i / 7:.4f} |" for i in range(300))
    printed = "\n".join(f"noise {i}\nq p{i} = {i / 7:.4f}" for i in range(300))
    assert verdict(rows, printed).status == "verified"
    drifted = printed.replace(f"{70 / 7:.4f}", "99.5").replace("q p3 ", "q p_3 ")
    assert [(change.recorded, change.printed) for change in verdict(rows, drifted).changes] == [
        ("p3  0.4286", ""),
        ("10.0000", "99.5"),
    ]


EDITED_HEAD = "| a | b | c |\n| --- | --- | --- |\n"


def table_after(
    rows: str, printed: str, comparison: Comparison = EXACT, filters: tuple[Filter, ...] = ()
) -> str:
    new = update(table(EDITED_HEAD + rows), printed, comparison, filters)
    return new.body_span.text.removeprefix(EDITED_HEAD)


def test_the_numbers_of_a_table_are_replaced_in_place() -> None:
    rows = "| `RK4` | **−0.000 %** |  3.9e-11|\n| Euler | +6.641 % | 6.9e-04 |"
    printed = "RK4    -0.001 % of 3.9e-11\nEuler  +6.702 % of 7.5e-04\n"
    assert table_after(rows, printed) == (
        "| `RK4` | **−0.001 %** |  3.9e-11|\n| Euler | +6.702 % | 7.5e-04 |"
    )
    assert table_after("| a | −1.5e-03 | 1.5e−03 |", "a -2.5e-03 -3.5e-03\n") == (
        "| a | −2.5e-03 | -3.5e−03 |"
    )
    rows, printed = "| a | 1,234 | 1\u202f234 |", "a  1234567  3456.5\n"
    assert table_after(rows, printed) == "| a | 1,234,567 | 3\u202f456.5 |"
    assert table_after("| a | 0.125 250 7 |", "a 0.1252508\n") == "| a | 0.125 250 8 |"
    assert table_after("| a | 3 m | 5% |", "a 4 m 6 %\n") == "| a | 4 m | 6% |"
    with pytest.raises(AssertionError, match="`mm` is not what is printed here"):
        table_after("| a | 3 mm | |", "a 4 m\n")


def test_a_table_under_digits_keeps_its_decimals() -> None:
    rows = "| Euler | 6.6 | 7e-04 |\n| RK4 | −1.25 | 4 |"
    printed = "Euler +6.7021 9.12e-04\nRK4 -2.349 5\n"
    assert table_after(rows, printed, DIGITS) == "| Euler | 6.7 | 9e-04 |\n| RK4 | −2.35 | 5 |"
    # a number with no more of them stays as it is printed
    assert table_after("| a | 0.123 | 4 |", "a 1.50e-01 4\n", DIGITS) == "| a | 1.50e-01 | 4 |"
    for mode in (EXACT, DIGITS):
        new = table_after("| a | 1,234.5 | 12,345 |", "a nan 6.20e-04\n", mode)
        assert new == "| a | nan | 6.20e-04 |"
    assert table_after(rows, printed, tolerance("0.01")) == (
        "| Euler | +6.7021 | 9.12e-04 |\n| RK4 | −2.349 | 5 |"
    )


def test_cells_are_numbers_as_people_write_them() -> None:
    printed = "Euler 5.507e-04 2.0\n"
    for row in (
        "| Euler | 5.51·10⁻⁴ | 2 |",
        "| Euler | $5.5\\cdot10^{-4}$ | 2.0 |",
        "| Euler | 5.5 × 10^-4 | 2.00 |",
        "| Euler | 5.51·10⁻⁴ | $\\out{}{2.0}$ |",
    ):
        assert compare(table(EDITED_HEAD + row), DIGITS, printed).status == "verified", row
    for row in (
        "| Euler | 5.52·10⁻⁴ | 2 |",
        "| Euler | 5.51·10⁻³ | 2 |",
        "| Euler | 5.5e-04 | 3 |",
    ):
        assert compare(table(EDITED_HEAD + row), DIGITS, printed).status == "drift", row
    bound = table(EDITED_HEAD + "| Euler | $E = 2.0${out} | 3 |")
    assert compare(bound, DIGITS, "Euler E = 2.0 3\n").status == "verified"
    row = "| Euler | 5.51·10⁻⁴ | $2.5\\times10^{-3}$ |"
    assert table_after(row, "Euler -0.123 1.5e12\n", DIGITS) == (
        "| Euler | -1.23·10⁻¹ | $1.5\\times10^{12}$ |"
    )


def test_a_decimal_comma_stays_in_a_table_of_its_language() -> None:
    rows = "| 0.5 | 0,71 | −2,5e-03 |"
    recording = table(EDITED_HEAD + rows)
    assert isinstance(recording.body, Table)
    german = replace(recording, body=replace(recording.body, comma=True))
    edit = update_body(german, EXACT, "a 0.5 0.82 -3.5e-03\n")
    assert isinstance(edit, Edit)
    assert edit.text == "0,82 | −3,5e-03"
    assert compare(german, EXACT, "a 0.5 0.71 -2.5e-03\n").status == "verified"
    assert compare(recording, EXACT, "a 0.5 0.71 -2.5e-03\n").status == "drift"
    recording = table(EDITED_HEAD + "| 0.5 | $0{,}71$ | −2,5e-03 |")
    assert isinstance(recording.body, Table)
    german = replace(recording, body=replace(recording.body, comma=True))
    assert compare(german, EXACT, "a 0.5 0.71 -2.5e-03\n").status == "verified"
    edit = update_body(german, EXACT, "a 0.5 0.82 -3.5e-03\n")
    assert isinstance(edit, Edit)
    assert edit.text == "0{,}82$ | −3,5e-03"


def test_a_number_that_a_macro_moves_or_shows_twice_is_replaced_once_or_not_at_all() -> None:
    words = Words(macros=(("pair", "#1 = #1"), ("swap", "#2 of #1")))
    rows = "| a | $\\swap{4.1}{3.01}$ | $\\pair{2.5}$ |"
    lesson = table(EDITED_HEAD + rows, words)
    edit = update_body(lesson, EXACT, "a 3.02 of 5.1 2.6 = 2.6\n")
    assert isinstance(edit, Edit)
    assert edit.text == "5.1}{3.02}$ | $\\pair{2.6"
    for printed in ("2.5 = 2.6", "2.6 = 2.5", "2.6 = 2.7"):
        assert isinstance(update_body(lesson, EXACT, f"a 3.01 of 4.1 {printed}\n"), Diagnostic)


CELLS = st.sampled_from(["Euler", "`RK4`", "**1.5 %**", "−2.50", "3.9e-11", "4", "x 7"])


@settings(max_examples=50)
@given(
    st.lists(st.tuples(CELLS, CELLS, CELLS), min_size=1, max_size=4),
    st.lists(
        st.sampled_from(["Euler 1.6 % -2.51 4", "RK4 1.5 % 3.8e-11 5", "x 7 x 8 -9.25", "4"]),
        min_size=1,
        max_size=5,
    ),
    st.sampled_from([EXACT, DIGITS, tolerance("0.5")]),
)
def test_tables_are_updated_right_or_refused(
    rows: list[tuple[str, str, str]], lines: list[str], comparison: Comparison
) -> None:
    lesson = table(EDITED_HEAD + "\n".join(f"| {a} | {b} | {c} |" for a, b, c in rows))
    printed = "\n".join(lines)
    outcome = update_body(lesson, comparison, printed)
    if isinstance(outcome, Edit):
        update(lesson, printed, comparison)
    elif isinstance(outcome, Diagnostic):
        assert outcome.rule == "output-not-updatable"
    else:
        assert compare(lesson, comparison, printed).status == "verified"


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


def test_svg_differs_by_parts_words_and_places() -> None:
    base = recorded('<path d="M0 0L10 1"/>')
    for inside, wording in CASES["svg"]:
        assert describe_difference("x.svg", base, recorded(inside)) == wording, inside
    broken = describe_difference("x.svg", base[:30], base)
    assert broken.startswith("the recorded file is not an SVG file: ")


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


def test_thousands_of_a_table_are_one_number_with_one_address() -> None:
    rows = "| 30 | 1,149 | 0.125 25 |\n| 60 | 152\u202f034 | 3 |"
    text = PrintedText.of_recording(table(EDITED_HEAD + rows))
    assert text.numbers == (("30", "1,149", "0.12525"), ("60", "152,034", "3"))
    assert text.words[0] == text.words[1] == "# # #"
