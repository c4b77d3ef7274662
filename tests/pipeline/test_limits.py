"""Limits of hostile texts, of small machines, and of courses with many lessons."""

from __future__ import annotations

import gc
import subprocess
import tracemalloc
from pathlib import Path

import pytest

from coursebuild.core.model.results import CachedFile
from coursebuild.core.syntax.document import parse_document
from coursebuild.core.text.source import Source
from coursebuild.pipeline.publication import build, make_files
from coursebuild.pipeline.reader import Reader
from coursebuild.pipeline.site import Site
from support.growth import processor_time_growth
from support.scratch_course import (
    GOOD,
    Folder,
    Make,
    block,
    command,
    kill_at_end,
    processes,
    wait_until_alone,
)
from support.waiting import wait_until

MAP = "content/course.toml"
BALL = "<mujoco><worldbody><body><freejoint/><geom size='1'/></body></worldbody></mujoco>"
LAB = """```lab
{"title": "A", "model": "ball", "readouts": [{"label": "t", "expr": "data.time"}]}
```
"""


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


@pytest.mark.long
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


@pytest.mark.site
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


@pytest.mark.site
def test_a_script_gets_the_memory_that_the_course_allows(make: Make) -> None:
    folder = make("## A\n\n" + block("big.py", "print(len(bytearray(300 << 20)))\n", "314572800"))
    assert folder.main("check").status == 0
    folder.write(MAP, folder.text(MAP) + "\n[limits]\nscripts = 256\n")
    result = folder.main("check")
    assert result.status == 1
    assert "error[script-failed]" in result.out and "MemoryError" in result.out


@pytest.mark.long
@pytest.mark.parametrize(
    "piece", ["<b>", "</b>", "<b></i>", "<a href=x", "- <p>\n", "[x](y) `", "<script>\n", "<title>"]
)
def test_reading_takes_as_long_as_the_text_whatever_is_broken_in_it(piece: str) -> None:
    def read(count: int) -> None:
        parse_document(Source("x.md", piece * count), frozenset(), lesson=False)

    assert processor_time_growth(read, 250) < 24


@pytest.mark.long
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


def run_limited(folder: Folder, limit: str, *arguments: str) -> tuple[int, str]:
    """The status of a command under a limit, and what it says."""
    result = subprocess.run(
        ["bash", "-c", f'ulimit {limit} && exec "$@"', "bash", *command(*arguments)],
        cwd=folder.root,
        env=folder.environment(),
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    return result.returncode, result.stdout


@pytest.mark.site
def test_limits_of_files_are_told_and_as_many_as_said_are_enough(make: Make) -> None:
    folder = make(GOOD + "$a_{17}$\n\n" + block("two.py", "print(2)", "2"))
    assert run_limited(folder, "-n 12", "check") == (
        2,
        "coursebuild: only 12 files may be open at a time, and 64 are needed\n"
        "  help: `ulimit -n 256` raises the limit\n",
    )
    status, output = run_limited(folder, "-n 64", "build", "--jobs", "2")
    assert status == 0, output
    assert run_limited(folder, "-s 1024", "check", "-q", "--no-cache") == (
        2,
        "coursebuild: formulas need a stack of 2 MiB, and this process may have 1024 KiB\n"
        "  help: `ulimit -s 8192` raises the limit\n",
    )
    assert run_limited(folder, "-s 2048", "check", "-q", "--no-cache") == (0, "")
    assert run_limited(folder, "-f 0", "check") == (
        2,
        "coursebuild: nothing may be written into any file\n"
        "  help: `ulimit -f unlimited` removes the limit\n",
    )


@pytest.mark.site
def test_where_v8_has_too_few_addresses_all_but_labs_is_made(make: Make) -> None:
    folder = make(GOOD + "$a_{18}$\n")
    folder.write("models/ball.xml", BALL)
    status, output = run_limited(folder, "-v 8388608", "build")
    assert status == 0, output
    assert "the pages of models have no labs: V8 needs more than the 8 GiB" in output
    assert "<msub>" in (folder.root / "public/lessons/1.1-one.html").read_text()
    page = folder.root / "public/models/ball.html"
    assert "data-lab" not in page.read_text()
    assert folder.run("build").status == 0
    assert "data-lab" in page.read_text()
    folder.write(folder.lesson(1), GOOD + "$a_{19}$\n\n" + LAB)
    status, output = run_limited(folder, "-v 8388608", "check")
    assert status == 2
    assert "coursebuild: V8 needs more than the 8 GiB of address space" in output
    assert "`ulimit -v unlimited`" in output
    assert "Traceback" not in output


@pytest.mark.site
@pytest.mark.engine
def test_a_lab_is_tried_without_a_place_for_its_model(make: Make) -> None:
    folder = make(GOOD + LAB)
    folder.write("models/ball.xml", BALL)
    status, output = run_limited(folder, "-f 1", "check")
    assert status == 0, output
    assert "1 lab tried: everything holds" in output


@pytest.mark.site
def test_doctor_says_what_it_could_not_try_and_tries_the_rest(make: Make) -> None:
    folder = make(GOOD)
    # There is no place for such a stack, hence none for a thread.
    status, output = run_limited(folder, "-s 70000000000", "doctor")
    lines = output.splitlines()
    lack = lines.index("broken   labs: can't start new thread")
    assert lines[lack + 1] == "         help: `ulimit -u` says how many processes there may be"
    assert "-        offscreen rendering: can't start new thread" in lines
    assert lines[lack + 2].startswith("ok ") and "can be written" in lines[lack + 2]
    assert lines[-1].startswith("broken: ")
    assert status == 1


FEW_LESSONS, MANY_LESSONS = 20, 50
TEXT = 20_000
"""Bytes of prose in a lesson."""
SLOPE = 160_000
"""Bytes that a further lesson may take: its text, its summary, names and keys of its files, and,
which is half of it, its packed tree until its page is drawn."""


def write_course(folder: Folder, count: int, thing: str, size: int = TEXT) -> None:
    """Write a course of some lessons, each with as much prose of a thing.

    A level has ten lessons, since each of its pages lists them all.
    """
    ids = [f"{1 + n // 10}.{1 + n % 10}" for n in range(count)]
    entries = ['[course]\ntitle = "Long"\n']
    for n, (id_, following) in enumerate(zip(ids, ids[1:] + ids[:1], strict=True)):
        prose = f"What is said of *this* {thing} is said of `that` one. " * 6 + "\n\n"
        code = "\n".join(f"print({i})  # {thing}" for i in range(120))
        text = block(f"s{n}.py", code, info="norun") + prose * (size // len(prose))
        links = f"See [there](#part), and [the next](lesson:{following}).\n"
        folder.write(f"content/lessons/{id_}-l.md", f"## Part {{#part}}\n\n{text}{links}")
        if n % 10 == 0:
            level = id_.split(".")[0]
            entries.append(f'[[level]]\nid = "{level}"\ntitle = "Level {level}"\n')
        entries.append(
            f'[[level.lesson]]\nid = "{id_}"\nslug = "l"\ntitle = "L {n}"\nstatus = "complete"\n'
        )
    folder.write("content/course.toml", "\n".join(entries))


def peak(folder: Folder) -> int:
    """The peak of Python's memory during a build, with the files that it makes, in bytes."""
    gc.collect()
    gc.freeze()  # else the garbage of other tests decides when the collector runs
    tracemalloc.start()
    try:
        options = folder.options()
        with Reader(options) as reader:
            report, site = make_files(options, reader, lambda lib: Site(lib, reader, options))
            assert site is not None, report.diagnostics
            for file in site.files:
                if file.path.endswith((".html", ".md", ".ipynb", ".epub")):
                    assert isinstance(file, CachedFile)
                    file.make()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
        gc.unfreeze()


@pytest.mark.slow
@pytest.mark.parametrize("again", [False, True], ids=["cold", "one edit"])
def test_memory_does_not_grow_with_the_lessons(tmp_path: Path, stores: Path, again: bool) -> None:
    peaks: dict[int, list[int]] = {FEW_LESSONS: [], MANY_LESSONS: []}
    # Several times: whatever else the process does can only add to it. Each has texts of its own:
    # what the process knows of equal ones was not counted.
    for number, count in enumerate((FEW_LESSONS, FEW_LESSONS, MANY_LESSONS, MANY_LESSONS)):
        folder = Folder(tmp_path / str(number))
        write_course(folder, count, f"thing {number}")
        folder.borrow(stores)
        if again:
            build(folder.options(), Path("public"))
            folder.replace("content/lessons/1.2-l.md", "See [there]", "See again [there]")
        peaks[count].append(peak(folder))
    slope = (min(peaks[MANY_LESSONS]) - min(peaks[FEW_LESSONS])) / (MANY_LESSONS - FEW_LESSONS)
    assert slope < SLOPE, f"{slope:.0f} bytes a lesson: {peaks}"
