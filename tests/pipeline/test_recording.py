"""How often scripts run: once to be recorded, again when somebody asks or nothing else is due."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from support.fixture_cases import fixture_text
from support.preview_process import Events, serve_preview
from support.scratch_course import SILENT, Folder, Make, block

pytestmark = pytest.mark.site

NOTE = "import os\nos.makedirs('runs', exist_ok=True)\nopen('runs/log', 'a').write('x')\n"
"""Lines by which a script counts its runs; its fence allows that."""
FALL = fixture_text("scripts/recorded_fall.txt")
PLAIN = "print('sum', 45)\n"
NOT_YET = "not yet repeated"


def lesson(code: str, output: str = "", name: str = "a.py") -> str:
    return "## One\n\n" + block(name, NOTE + code, output, info="writes=runs")


def count(folder: Folder) -> int:
    """How often scripts ran since this was last asked."""
    log = folder.root / "runs/log"
    runs = len(log.read_text()) if log.exists() else 0
    folder.write("runs/log", "")
    return runs


@pytest.fixture
def course(make: Make) -> Folder:
    folder = make(lesson(FALL))
    folder.write("runs/log", "")
    return folder


def test_a_new_script_runs_once_until_it_is_measured(course: Folder) -> None:
    result = course.main("check")
    assert (result.status, count(course)) == (1, 0)
    assert "error[output-drift]: no output of `examples/a.py` is recorded yet" in result.out
    assert "unrecorded examples/a.py  (nothing recorded" in result.out
    assert "and 1 script that was not run (nothing recorded)" in result.out

    result = course.main("update")
    assert (result.status, count(course)) == (0, 1)
    assert "z 10.350 m\n```" in course.text(course.lesson())
    assert result.out.endswith("everything holds; 1 script recorded, not yet repeated\n")
    for command in ("update", "check", "build"):
        result = course.main(command)
        assert (result.status, count(course)) == (0, 0)
    assert result.out.endswith("everything holds; 1 script recorded, not yet repeated\n")
    page = course.text("public/lessons/1.1-one.html")
    assert "Recorded, not yet repeated: one run printed this, with MuJoCo" in page

    result = course.main("check", "--sensitivity", "--strict").require_success()
    stages = ("moving initial states", "halving timesteps", "shifting steps")
    repeats = sum(map(result.err.count, stages))
    assert (count(course), repeats >= 7) == (1 + repeats, True)
    for command in ("check", "build", "update"):
        strict = () if command == "update" else ("--strict",)
        assert (course.main(command, *strict).status, count(course)) == (0, 0)
    page = course.text("public/lessons/1.1-one.html")
    assert "Verified with MuJoCo" in page and NOT_YET not in page


def test_a_table_says_how_many_printed_rows_it_shows(make: Make) -> None:
    code = "for n in range(1, 6):\n    print('n', n, 'square', n * n)"
    script = f"```python file=examples/a.py\n{code}\n```"
    table = "| n | square |\n| --- | --- |\n| 1 | 1 |\n| 3 | 8 |"
    course = make(f"## One\n\n{script}\n\nOutput, as a table:\n\n{table}\n")
    receipts = {("update",): "not yet repeated:", ("check", "--sensitivity"): "Verified with"}
    for arguments, receipt in receipts.items():
        course.main(*arguments)
        assert course.main("build").status == 0
        page = course.text("public/lessons/1.1-one.html")
        assert receipt in page and "It shows 2 of 5 printed rows." in page


def test_a_changed_script_runs_once(course: Folder) -> None:
    course.main("update", "-q")
    course.main("check", "--sensitivity", "-q")
    count(course)
    course.replace(course.lesson(), 'print(f"z ', 'print(f"height ')
    for command, runs in (("check", 1), ("check", 0), ("update", 0), ("check", 0)):
        result = course.main(command)
        assert count(course) == runs, command
    assert result.out.endswith(f"; 1 script recorded, {NOT_YET}\n")
    course.replace(course.lesson(), 'print(f"height ', 'print(f"z = ')
    assert (course.main("update").status, count(course)) == (0, 1)


def test_what_was_recorded_before_a_run_is_borne_out_by_it(make: Make) -> None:
    folder = make(lesson(PLAIN, "sum 45"))
    folder.write("runs/log", "")
    assert (folder.main("check", "--strict").status, count(folder)) == (0, 1)
    folder.replace(folder.lesson(), "sum 45\n```", "sum 44\n```")  # a slip, and its repair
    assert (folder.main("check").status, count(folder)) == (1, 0)
    folder.main("update", "-q")
    result = folder.main("check", "--strict")
    assert (result.status, NOT_YET in result.out, count(folder)) == (0, False, 0)


def test_an_output_added_to_a_script_that_has_run_is_not_repeated(make: Make) -> None:
    folder = make("## One\n\n" + block("a.py", NOTE + PLAIN, info="writes=runs"))
    folder.write("runs/log", "")
    assert (folder.main("check", "--strict").status, count(folder)) == (0, 1)
    folder.write(folder.lesson(), lesson(PLAIN))
    assert (folder.main("update").status, count(folder)) == (0, 0)
    assert NOT_YET in folder.main("check").out
    result = folder.main("check", "--sensitivity")
    assert (result.status, count(folder)) == (0, 1), "nothing in it can be moved"


@pytest.mark.parametrize("command", ["check", "build"])
def test_a_strict_command_repeats_what_is_recorded_once(course: Folder, command: str) -> None:
    course.main("update", "-q")
    count(course)
    for runs in (1, 0):
        result = course.main(command, "--strict")
        assert (result.status, NOT_YET in result.out, count(course)) == (0, False, runs)


def test_an_update_that_did_not_write_leaves_its_run_to_the_next(course: Folder) -> None:
    course.main("update", "--dry-run")
    assert count(course) == 1
    process = course.start("update", env=SILENT)
    result = course.run("update")
    assert (process.wait(), result.status, count(course)) == (0, 0, 0)
    assert course.text(course.lesson()).count("z 10.350 m") == 1
    assert NOT_YET in course.main("check").out


def test_a_script_that_fails_is_not_tried_again(make: Make) -> None:
    folder = make(lesson("raise SystemExit(3)"))
    folder.write("runs/log", "")
    for runs in (1, 0):
        result = folder.main("update")
        assert (result.status, count(folder)) == (1, runs)
        assert "error[script-failed]" in result.out
    assert "error[script-failed]" in folder.main("check").out


@pytest.mark.parametrize(
    "code",
    [
        "import os\nprint('process', os.getpid())",
        "import time\nprint(f'took {time.perf_counter():.9f} s')",
    ],
)
def test_an_output_that_varies_is_found_by_the_second_run(make: Make, code: str) -> None:
    folder = make(lesson(code))
    folder.write("runs/log", "")
    assert (folder.main("update").status, count(folder)) == (0, 1)
    assert (folder.main("check").status, count(folder)) == (0, 0)
    result = folder.main("check", "--strict")
    assert (result.status, count(folder)) == (1, 1)
    assert "error[output-unstable]" in result.out and "a fixed seed, no clock" in result.out
    assert "two runs of it differed" in folder.main("explain", "examples/a.py").out
    result = folder.main("check")
    assert ("error[output-unstable]" in result.out, count(folder)) == (True, 2)


def test_a_result_of_others_is_as_little_repeated_as_there(make: Make, tmp_path: Path) -> None:
    (tmp_path / "shared").mkdir()
    folder, cache = make(lesson(PLAIN)), ("--cache", str(tmp_path / "shared"))
    folder.write("runs/log", "")
    folder.main("update", *cache)
    copy = Folder(tmp_path / "copy")
    copy.copy(folder.root)
    copy.tmp.mkdir()
    count(copy)
    assert NOT_YET in copy.main("check", *cache).out
    assert count(copy) == 0
    assert copy.main("check", "--strict", *cache).status == 0
    assert count(copy) == 1
    alone = Folder(copy.root).main("check", "--strict", "--no-cache")
    assert (alone.status, count(copy)) == (0, 1), "a run of one's own is another"


def test_report_says_what_is_not_repeated(make: Make) -> None:
    folder = make(lesson(PLAIN))
    folder.write("runs/log", "")
    folder.main("update", "-q")
    report = json.loads(folder.main("check", "--format", "json").out)
    assert (report["summary"]["unrepeated"], report["scripts"][0]["unrepeated"]) == (1, True)


@pytest.mark.parametrize(("code", "more_runs"), [(FALL, 4), (PLAIN, 0)])
def test_preview_offers_what_one_run_printed_and_repeats_it_when_idle(
    make: Make, code: str, more_runs: int
) -> None:
    folder = make(lesson(code))
    folder.write("runs/log", "")
    page = "/lessons/1.1-one.html"
    with serve_preview(folder) as preview, preview.events() as events:
        assert preview.accept_offer(events.offered()[0]["offer"])[0] == 200
        events.until(lambda _: "Verified with " in preview.get(page)[2].decode())
        events.wait_until_settled()
    assert count(folder) >= 2 + more_runs
    result = folder.main("check", "--strict")
    assert (result.status, count(folder)) == (0, 0), "its results are kept"


def test_preview_tells_noise_and_what_varies_when_idle(make: Make) -> None:
    swing = FALL.replace("10'", "10' euler='0 0 1'").replace(".3f", ".17g")
    folder = make(
        lesson(swing),
        "## Two\n\n" + block("b.py", "import os\nprint('process', os.getpid())", ""),
    )
    folder.write("runs/log", "")
    folder.main("update", "-q")
    with serve_preview(folder) as preview, preview.events() as events:
        events.wait_until_settled("output-noise", "output-unstable")  # its own first

        def noisy_line(page: Events) -> str:
            places = (p["place"] for p in page.news["problems"] if p["rule"] == "output-noise")
            lines = folder.text(folder.lesson()).splitlines()
            return next((lines[int(place.split(":")[1]) - 1] for place in places), "")

        folder.replace(folder.lesson(), "## One\n", "## One\n\nText.\n")
        events.until(lambda page: page.news["busy"] == "" and noisy_line(page).startswith("z "))
        assert {*events.rules()} == {"output-unstable", "output-noise"}


# --- figures and data


LINE = fixture_text("scripts/recorded_line.txt")


def drawing(path: str, end: float) -> str:
    return block(path, LINE.format(end=end), "drawn True", info="figure=line.svg")


def line_lesson(end: float) -> str:
    return f"## A line\n\n{drawing('line.py', end)}Figure: ![A line](line.svg) It *rises*.\n"


def test_figure_is_recorded_compared_and_shown(make: Make) -> None:
    folder = make(line_lesson(9))
    first = folder.main("check")
    assert first.status == 1
    assert "figure-drift]: no figure of `examples/line.py` is recorded yet" in first.out
    update = folder.main("update").require_success()
    assert "drew content/lessons/line.svg" in update.out
    assert not (folder.root / "line.svg").exists()
    assert folder.main("check").status == 0
    assert folder.main("build").status == 0
    page = folder.text("public/lessons/1.1-one.html")
    assert 'alt="A line"' in page
    assert "It <em>rises</em>." in page
    assert '<a href="#line.py">Drawn by examples/line.py</a>' in page
    folder.write(folder.lesson(), line_lesson(5))
    drifted = folder.main("check")
    assert "figure-drift]: the recorded figure differs from this run: 1 of its parts moved" in (
        drifted.out
    )
    assert folder.main("update", "--dry-run").out.count("would draw content/lessons/line.svg") == 1
    assert folder.main("check").status == 1
    assert folder.main("update").status == 0
    assert folder.main("check").status == 0
    folder.replace("content/lessons/line.svg", "L5 9", "L4 9")
    output = folder.main("check").out  # with a remembered run
    assert "cached" in output and "the recorded figure differs from this run" in output


def test_data_are_recorded_and_linked(make: Make) -> None:
    code = LINE.format(end=9) + 'with open("line.csv", "w") as file:\n    file.write("x\\n9\\n")\n'
    lesson = block("line.py", code, "drawn True", info="figure=line.csv,line.svg")
    text = f"## A line\n\n{lesson}Figure: A line that rises.\n"
    folder = make(text)
    folder.main("update").require_success()
    assert folder.text("content/lessons/line.csv") == "x\n9\n"
    assert folder.main("build").status == 0
    page = folder.text("public/lessons/1.1-one.html")
    assert '<a href="../files/lessons/line.csv" download>Data</a>' in page
    folder.write(folder.lesson(), text.replace("9\\n", "7\\n"))
    assert "figure-drift]: the recorded data differ from this run: 1 of its cells" in (
        folder.main("check").out
    )


def test_figure_of_a_run_that_the_course_keeps_stays_as_it_was(make: Make) -> None:
    once = block("line.py", LINE.format(end=9), "drawn True", info="figure=line.svg record=once")
    folder = make(f"## A line\n\n{once}Figure: ![A line](line.svg)\n")
    assert folder.main("update", "--long").status == 0
    assert folder.main("check").status == 0


def test_scripts_that_draw_under_one_name_do_not_meet(make: Make) -> None:
    second = drawing("other.py", 3)
    folder = make(line_lesson(9), f"## Other\n\n{second}Figure: ![Another](other/line.svg)\n")
    folder.write("line.svg", "the author's own")
    assert folder.main("update").status == 0
    assert folder.main("check").status == 0
    assert "L9 9" in folder.text("content/lessons/line.svg")
    assert "L3 9" in folder.text("content/lessons/other/line.svg")
    assert folder.text("line.svg") == "the author's own"
