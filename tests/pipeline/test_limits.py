"""Limits of hostile texts."""

from __future__ import annotations

import pytest

from coursebuild.core.syntax.document import parse_document
from coursebuild.core.text.source import Source
from support.growth import processor_time_growth
from support.scratch_course import GOOD, Make, block, kill_at_end, processes, wait_until_alone
from support.waiting import wait_until

MAP = "content/course.toml"


def test_a_line_of_megabytes_is_told_and_not_read(make: Make) -> None:
    folder = make(GOOD, "a *b* " * 1_700_000)
    result = folder.main("check")
    assert result.status == 1
    assert "1.2-two.md has 10_200_000 characters; the limit is 250_000" in result.out
    assert f"{folder.lesson(2)}:1:250001" in result.out and len(result.out) < 2_000
    assert "1 error" in result.out
    folder.write(folder.lesson(2), GOOD.replace("hello.py", "again.py") + "words " * 50_000)
    folder.write(MAP, folder.text(MAP) + "\n[limits]\ntext = 400_000\n")
    assert folder.main("check").status == 0


def test_a_map_or_model_that_is_too_long_is_told_and_not_read(make: Make) -> None:
    folder = make(GOOD)
    short, long = "<mujoco/>\n", "<mujoco>\n" + "<!-- -->\n" * 30_000 + "</mujoco>\n"
    folder.write("models/a.xml", short)
    folder.write("models/b.xml", long)
    folder.write("models/a.toml", "# nothing\n" * 30_000)
    result = folder.main("check")
    assert result.status == 1
    assert "models/b.xml has 270_019 characters; the limit is 250_000" in result.out
    assert "models/b.xml:27778:" in result.out and "help: shorten it, or set `text`" in result.out
    assert "models/a.toml has 300_000 characters" in result.out
    assert "2 errors" in result.out
    folder.write(MAP, folder.text(MAP) + "\n[limits]\ntext = 400_000\n")
    assert folder.main("check").status == 0
    folder.write(MAP, folder.text(MAP) + "# and more\n" * 100_000)
    result = folder.main("check")
    assert result.status == 1
    assert "course.toml has 1_100_" in result.out and "the limit is 1_000_000" in result.out
    assert "make more courses of it" in result.out


def test_a_killed_check_leaves_no_compiler_and_the_next_one_its_folder_no_more(make: Make) -> None:
    folder = make(GOOD)
    endless = '<replicate count="300000000"><geom size="1"/></replicate>'
    folder.write("models/a.xml", f"<mujoco><worldbody>{endless}</worldbody></mujoco>\n")
    folder.write(MAP, folder.text(MAP) + "\n[limits]\nmodels = 10_000\n")
    with kill_at_end(folder.start("check")) as process:
        wait_until(lambda: len(processes(folder)) > 1, "the process that compiles")
        process.kill()
        process.wait()
        wait_until_alone(folder)
    (left,) = folder.tmp.iterdir()
    folder.write("models/a.xml", "<mujoco/>\n")
    with kill_at_end(folder.start("check")) as process:
        assert process.wait() == 0
    assert [*folder.tmp.iterdir()] == [], left


def test_a_script_gets_the_memory_that_the_course_allows(make: Make) -> None:
    folder = make("## A\n\n" + block("big.py", "print(len(bytearray(300 << 20)))\n", "314572800"))
    assert folder.main("check").status == 0
    folder.write(MAP, folder.text(MAP) + "\n[limits]\nscripts = 256\n")
    result = folder.main("check")
    assert result.status == 1
    assert "error[script-failed]" in result.out and "MemoryError" in result.out


@pytest.mark.parametrize(
    "piece",
    ["<b>", "</b>", "<b></i>", "<a href=x", "- <p>\n", "[x](y) `", "<script>\n", "<title>"],
)
def test_reading_takes_as_long_as_the_text_whatever_is_broken_in_it(piece: str) -> None:
    def read(count: int) -> None:
        parse_document(Source("x.md", piece * count), frozenset(), lesson=False)

    assert processor_time_growth(read, 250) < 24


@pytest.mark.parametrize("quotes", ["> ", "> 1. "])
def test_containers_that_hold_too_many_lines_together_are_told_and_read_no_further(
    quotes: str,
) -> None:
    def read(depth: int) -> list[str]:
        text = quotes * depth + "A\n" + "B\n" * 4_000
        return [
            d.rule
            for d in parse_document(Source("x.md", text), frozenset(), lesson=False).diagnostics
        ]

    assert (read(2), read(16)) == ([], ["nesting-deep"])
    assert processor_time_growth(read, 2) < 5, "the depth is another, the text is not"


@pytest.mark.parametrize("item", ["* A\n\n    B\n\n", "* A\n    * B\n", "> 1. A\n>\n>    B\n>\n"])
def test_a_long_list_is_not_taken_for_a_deep_one(item: str) -> None:
    document = parse_document(Source("x.md", item * 1_000), frozenset(), lesson=False)
    assert document.diagnostics == ()
