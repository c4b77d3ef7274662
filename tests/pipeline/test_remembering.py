"""What a lesson shows has an address, which is remembered, and follows a changed parameter."""

from __future__ import annotations

import re
import shutil

import pytest

from support.fixture_cases import fixture_tables, fixture_text
from support.scratch_course import Folder, Make

pytestmark = pytest.mark.site

CUPS = fixture_text("documents/remembered_cups.md")
TABLE = fixture_text("documents/remembered_table.md")
RECORD = "content/lessons/1.1-one.recorded.txt"


def cups(folder: Folder) -> str:
    return folder.text(folder.lesson()).partition("Output, the fits:")[2]


def make_cups(make: Make) -> Folder:
    script = f"```python file=examples/cups.py\n{CUPS}\n```\n\n"
    folder = make(f"## Cups\n\n{script}{TABLE}")
    folder.main("check").require_success()
    return folder


def test_a_table_and_its_numbers_follow_a_changed_parameter(make: Make) -> None:
    """The rates of the cups, and not the quartiles that are printed above them."""
    folder = make_cups(make)
    folder.replace(folder.lesson(), "scale = 1.0", "scale = 2.0")
    folder.main("update").require_success()
    assert "| steel | 169.8 | 0.0121 | 167.0 |" in cups(folder)
    assert '`157.0 min`{out="mean of tau"}, and for glass `147.0`{out}.' in cups(folder)
    assert 'For steel it takes `167.0`{out="steel τ"} min.' in cups(folder)
    assert folder.main("check").status == 0
    assert "every recorded output is up to date" in folder.main("update").out


def test_addresses_survive_a_clone(make: Make) -> None:
    folder = make_cups(make)
    before = folder.text(RECORD)
    shutil.rmtree(folder.root / ".coursebuild")
    folder.replace(folder.lesson(), "scale = 1.0", "scale = 0.5")
    assert folder.main("update").status == 0
    assert "for glass `36.8`{out}." in cups(folder)
    assert folder.text(RECORD) != before  # the shown texts, at the same addresses


def test_a_line_that_is_gone_is_told_and_nothing_is_written(make: Make) -> None:
    folder = make_cups(make)
    text = folder.text(folder.lesson())
    folder.write(folder.lesson(), text.replace('f"mean of tau', 'f"average', 1))
    result = folder.main("update")
    assert result.status != 0
    assert "printed no number right after `mean of tau`" in result.out
    assert '`78.5 min`{out="mean of tau"}' in cups(folder)


def test_lines_that_nothing_tells_apart_are_one_place_while_they_agree(make: Make) -> None:
    script = """scale, second = 1.0, 1.0
for ball, factor in (("one ball", 1.0), ("another ball", second)):
    print(f"{ball}, 3 g\\nweaker gravity {scale * factor:.3f} ms")
print("step 1.000 s")"""
    script = f"```python file=examples/a.py\n{script}\n```\n\n```output\n```"
    folder = make(f"{script}\n\nIt is `1.000`{{out}} ms.\n")
    assert folder.main("update").status == 0
    folder.replace(folder.lesson(), "scale, second = 1.0", "scale, second = 2.0")
    assert folder.main("update").status == 0
    assert "It is `2.000`{out} ms." in folder.text(folder.lesson())
    folder.replace(folder.lesson(), "second = 2.0, 1.0", "second = 2.0, 1.5")
    assert folder.main("update").status != 0
    assert "It is `2.000`{out} ms." in folder.text(folder.lesson())


def test_a_row_is_found_where_the_number_in_its_heading_is_another(make: Make) -> None:
    script = """step = 2
print(f"depths at a timestep of {step} ms:")
for tau in (10, 4, 3):
    print(f"  tau {tau} ms  {tau * step} um")"""
    script = f"```python file=examples/a.py\n{script}\n```\n\n```output\n```"
    folder = make(f"{script}\n\nIt is `8`{{out}} um.\n")
    assert folder.main("update").status == 0
    folder.replace(folder.lesson(), "step = 2", "step = 5")
    assert folder.main("update").status == 0
    sentence, lines = "It is `20`{out} um.", folder.text(folder.lesson()).split("\n")
    assert sentence in lines
    explain = folder.main("explain", f"{folder.lesson()}:{lines.index(sentence) + 1}")
    line = "`tau # ms # um`, where it begins with 4 below `depths at a timestep of # ms:`"
    assert f"number 2 of {line}" in explain.out

    folder.replace(folder.lesson(), "(10, 4, 3)", "(10, 5, 3)")
    result = folder.main("update")
    assert result.status == 1
    assert f"the line that showed `20` is no longer printed: {line}" in result.out


def test_explain_says_where_the_numbers_of_a_line_come_from(make: Make) -> None:
    folder = make_cups(make)
    lines = folder.text(folder.lesson()).split("\n")
    line = next(n for n, text in enumerate(lines, start=1) if text.startswith("| steel"))
    result = folder.main("explain", f"{folder.lesson()}:{line}")
    assert (
        result.out
        == f"""\
{folder.lesson()}:{line} shows 1 value
  `steel  84.9  0.0121  83.5` is printed by examples/cups.py
    number 1 of `steel T0 = # \u00b0C k = # 1/min tau = # min`
    number 2 of `steel T0 = # \u00b0C k = # 1/min tau = # min`
    number 3 of `steel T0 = # \u00b0C k = # 1/min tau = # min`
"""
    )
    result = folder.main("explain", f"{folder.lesson()}:{line + 2}")
    assert "number 1 of `mean of tau # min`" in result.out
    assert folder.main("explain", f"{folder.lesson()}:999").status == 2


def test_explain_says_where_words_and_settings_are_printed(make: Make) -> None:
    script = 'for step in (2, 10):\n    print(f"at {step} ms it rests {step**2:.2f} um deep")'
    script = f"```python file=examples/b.py\n{script}\n```\n\n```output\n```"
    folder = make(f"{script}\n\nAt `2 ms`{{out}} it `rests`{{out}}.\n")
    assert folder.main("update").status == 0
    lines = folder.text(folder.lesson()).split("\n")
    at = next(n for n, text in enumerate(lines, start=1) if text.startswith("At "))
    result = folder.main("explain", f"{folder.lesson()}:{at}")
    first, second = "at 2 ms it rests 4.00 um deep", "at 10 ms it rests 100.00 um deep"
    assert (
        result.out
        == f"""\
{folder.lesson()}:{at} shows 2 values
  `2 ms` is printed by examples/b.py
    number 1 of `{first}`, which has its words in common with other lines
    recorded at {folder.lesson()}:7:4
  `rests` is printed by examples/b.py
    words of `{first}`
    words of `{second}`
    recorded at {folder.lesson()}:7:12
    recorded at {folder.lesson()}:8:13
"""
    )


def test_a_lesson_with_an_error_keeps_what_is_remembered(make: Make) -> None:
    folder = make_cups(make)
    before = folder.text(RECORD)
    folder.replace(folder.lesson(), "scale = 1.0", "scale = 2.0")
    assert folder.main("check").status == 1
    assert folder.text(RECORD) == before


def test_a_table_is_filled_below_its_header(make: Make) -> None:
    script = f"```python file=examples/cups.py\n{CUPS}\n```\n\n"
    rows = "| steel | 84.9 | 0.0121 | 83.5 |\n"
    folder = make(f"## Cups\n\n{script}{TABLE.replace(rows, '')}")
    assert folder.main("check").status == 1
    assert folder.main("update").status == 0
    assert f"{rows}| glass | 86.9 | 0.0131 | 73.5 |\n" in cups(folder)
    assert folder.main("check").status == 0


EVERYWHERE = fixture_text("documents/bound_everywhere.md")
PLACES = fixture_tables("remembered_places")["places"]


@pytest.mark.engine
def test_numbers_are_bound_wherever_a_course_shows_them(make: Make) -> None:
    folder = make(EVERYWHERE)
    folder.write("models/swing.xml", "<mujoco/>\n")
    summary = 'summary = "It takes `{}`{{out=examples/swing.py}} s."\n'
    objectives = 'objectives = ["Measure `{}`{{out=examples/swing.py}} s"]\n'
    folder.replace("content/course.toml", "[course]\n", "[course]\n" + summary.format("2.006"))
    lesson = "[[level.lesson]]\n"
    folder.replace("content/course.toml", lesson, lesson + objectives.format("2.006"))
    folder.write("content/lessons/swing.svg", "")
    assert folder.main("update").status == 0
    folder.main("check").require_success()
    folder.replace(folder.lesson(), "period = 2.006", "period = 2.5")
    assert folder.main("update").status == 0
    text, course_map = folder.text(folder.lesson()), folder.text("content/course.toml")
    assert [name for name, place in PLACES.items() if place.format("2.500") not in text] == []
    assert summary.format("2.500") in course_map and objectives.format("2.500") in course_map
    assert folder.main("build").status == 0
    pages = [folder.text(f"public/lessons/1.1-one.{kind}") for kind in ("html", "md", "ipynb")]
    assert not [page for page in pages if re.search(r"\bout\b[={]|\\out\b", page)]
    page = pages[0]
    assert r'alt="A swing of 2.500 s, half \frac{2.500}{2}"' in page
    assert "A swing of 2.500 s" in page and "at 2.500 s" in page
    assert "It takes 2.500 s." in folder.text("public/index.html")
    line = course_map.split("\n").index(summary.format("2.500").strip()) + 1
    explain = folder.main("explain", f"content/course.toml:{line}")
    assert "`2.500` is printed by examples/swing.py" in explain.out
    folder.write(folder.lesson(), text.replace("2.500", "2.501").replace("= 2.501", "= 2.5"))
    folder.write("content/course.toml", course_map.replace("2.500", "2.501"))
    result = folder.main("check")
    assert f": {len(PLACES) + 2} errors;" in result.out, result.out
