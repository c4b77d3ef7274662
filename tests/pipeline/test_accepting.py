"""`serve`: what a script prints anew is accepted in the page, alone or with others, and undone."""

from __future__ import annotations

import json
import re
import signal

import pytest

from coursebuild.core.files.locks import project_lock
from support.fixture_cases import fixture_text
from support.preview_process import serve_preview
from support.scratch_course import GOOD, WAIT_FOR_GO, Make, block

pytestmark = pytest.mark.site

RECORD = "content/lessons/1.1-one.recorded.txt"


def test_output_is_accepted(make: Make) -> None:
    lesson = "## Random\r\n\r\n" + GOOD.replace("\n", "\r\n").replace(
        "3.14159\r\n```\r\n\r\n", "3\r\n```\r\n"
    )
    folder = make(lesson)
    with serve_preview(folder) as preview, preview.events() as events:
        (output,) = events.offered()
        assert (output["script"], output["nth"], output["state"]) == (
            "examples/hello.py",
            0,
            "drift",
        )
        assert output["rows"] == [
            ["-", [["hello ", False], ["3", True]]],
            ["+", [["hello ", False], ["3.14159", True]]],
        ]
        request = {"page": "lessons/1.1-one.html", "id": output["offer"]}
        body = json.dumps(request).encode()
        right = {"Origin": f"http://127.0.0.1:{preview.port}"}
        before = folder.read(folder.lesson())
        unread = (400, {"message": "the request cannot be read"})
        no_such_offer = (
            409,
            {"message": "this is no longer what the page offers; look at it again"},
        )
        for changes, data, answer in (
            (
                {"Origin": ""},
                body,
                (403, "a request that changes something says where it comes from\n"),
            ),
            (
                {"Host": "evil.example"},
                body,
                (403, "pages of other origins cannot use the preview\n"),
            ),
            ({}, b"{", unread),
            ({}, b'{"page": 1, "id": 2}', unread),
            ({}, b"x" * 70_000, unread),
            ({}, json.dumps({**request, "id": "0" * 24}).encode(), no_such_offer),
            ({}, json.dumps({**request, "page": "index.html"}).encode(), no_such_offer),
        ):
            headers = {name: value for name, value in (right | changes).items() if value}
            assert preview.accept(data, **headers) == answer, (changes, data[:40])
        assert folder.read(folder.lesson()) == before
        assert preview.accept(body, **right) == (200, {"message": ""})
        assert folder.read(folder.lesson()) == before.replace(b"hello 3\r", b"hello 3.14159\r")
        events.wait_until_settled()
        assert events.news["outputs"][0]["state"] == "verified"
    undone = folder.main("undo")
    assert (undone.status, undone.out) == (0, f"restored {folder.lesson()}\nrestored {RECORD}\n")
    assert folder.read(folder.lesson()) == before


def test_several_offers_are_accepted_at_once_or_not_at_all(make: Make) -> None:
    lesson = "## Two\n\n" + block("a.py", "print(1)", "2") + block("b.py", "print(3)", "4")
    folder = make(lesson)
    with serve_preview(folder) as preview, preview.events() as events:
        events.until(lambda page: sum(bool(o.get("offer")) for o in page.news["outputs"]) == 2)
        ids = [output["offer"] for output in events.news["outputs"]]
        for bad_ids in ("", " ", f"{ids[0]} {'0' * 24}"):
            assert preview.accept_offer(bad_ids)[0] == 409
        assert folder.text(folder.lesson()) == lesson
        assert preview.accept_offer(" ".join(ids)) == (200, {"message": ""})
        changed = lesson.replace("```text\n2\n", "```text\n1\n").replace(
            "```text\n4\n", "```text\n3\n"
        )
        assert folder.text(folder.lesson()) == changed
        events.wait_until_settled()
    assert folder.main("undo").status == 0
    assert folder.text(folder.lesson()) == lesson


def test_each_click_is_undone_alone_and_needs_no_other_command_to_end(make: Make) -> None:
    lesson = "> [!nte] One\n>\n> Text.\n\n> [!tpi] Two\n>\n> Text.\n"
    folder = make(lesson)
    with serve_preview(folder) as preview, preview.events() as events:
        events.until(lambda page: sum(bool(p.get("offer")) for p in page.news["problems"]) == 2)
        with project_lock(folder.root):  # as `check` holds it while scripts run
            assert preview.accept_offer(events.news["problems"][0]["offer"])[0] == 200
        half = lesson.replace("nte", "note")
        assert folder.text(folder.lesson()) == half
        events.until(lambda page: [p["line"] for p in page.news["problems"]] == ["> [!tpi] Two"])
        assert preview.accept_offer(events.news["problems"][0]["offer"])[0] == 200
    for text in (half, lesson):
        assert folder.main("undo").status == 0
        assert folder.text(folder.lesson()) == text
    assert folder.main("undo").status == 1


def test_what_runs_is_told_with_the_time_that_it_took(make: Make) -> None:
    slow = f"{WAIT_FOR_GO}import time\ntime.sleep(1.2)\nprint(1)"
    folder = make("## Slow\n\n" + block("slow.py", slow, "1", info="timeout=600"))
    folder.write("go", "")
    assert folder.run("check").status == 0
    (folder.root / "go").unlink()
    with serve_preview(folder) as preview, preview.events() as events:
        events.wait_until_settled()
        assert events.news["running"] == []
        folder.replace(folder.lesson(), "1.2", "1.3")
        events.until(lambda page: bool(page.news["running"]))
        (script,) = events.news["running"]
        assert (script["path"], script["last"] > 1.0) == ("examples/slow.py", True)
        assert abs(events.hello["now"] - script["began"]) < 10_000  # by the same clock
        folder.write("go", "")
        events.wait_until_settled()
        assert events.news["running"] == []
        line = preview.wait_for_line("running examples/slow.py (")
        assert line.endswith(" s the last time)")


def test_what_changed_since_is_not_written(make: Make) -> None:
    folder = make(GOOD.replace("hello 3.14159", "hello 3"))
    with serve_preview(folder) as preview, preview.events() as events:
        id = events.offered()[0]["offer"]
        # A lesson is saved while the server is suspended, so that it has not noticed.
        preview.process.send_signal(signal.SIGSTOP)
        folder.replace(folder.lesson(), "## Hello", "## Mine")
        mine = folder.read(folder.lesson())
        preview.process.send_signal(signal.SIGCONT)
        status, answer = preview.accept_offer(id)
        assert status == 409
        assert answer["message"] in (
            "content/lessons/1.1-one.md was changed in the meantime",
            "this is no longer what the page offers; look at it again",
        )
        assert folder.read(folder.lesson()) == mine


def test_what_cannot_be_recorded_is_not_offered(make: Make) -> None:
    """An output that differs from run to run; a number whose line in the output is unknown."""
    clock = "import time\nprint('took', time.time_ns())"
    code = "print('period', 2.95, 's')\nprint('half', 1.975, 's')"
    folder = make(
        "## Swing\n\n"
        + block("clock.py", clock, "took 12")
        + block("x.py", code, "period 2.95 s\nhalf 1.975 s")
        + "`2.006`{out}\n"
    )
    with serve_preview(folder) as preview, preview.events() as events:
        events.until(lambda page: any(o.get("refused") for o in page.news["outputs"]))
        (output, _) = events.news["outputs"]
        assert output["offer"] is None
        assert output["refused"] == "two runs of the script printed different lines"
        events.until(lambda page: bool(page.news["numbers"]))
        (number,) = events.news["numbers"]
        assert (number["better"], number["offer"]) == ("", None)
        assert number["label"] == "the nearest printed value is 1.975"


def test_output_of_an_edited_script_is_not_taken_for_another_run_of_it(make: Make) -> None:
    """An output that differs is printed once more, unless the script has changed since."""
    folder = make(block("mass.py", "print('kg', 7)", "kg 1"))
    with serve_preview(folder) as preview:
        preview.wait_for_line("checked: still 1 error")  # it has run once more
        folder.replace(folder.lesson(), "'kg', 7", "'kg', 8")
        preview.wait_for_line("this run printed 8")
        assert "output-unstable" not in "\n".join(preview.lines)


def test_one_click_accepts_an_output_and_all_numbers_at_their_addresses(make: Make) -> None:
    """Not the nearest number, which is another quantity; also those of another lesson."""
    code = "print('period', 2.95, 's')\nprint('half', 1.975, 's')"
    prose = "The period is `2.006`{out}.\n"
    again = "## Again\n\n`2.01 s`{out=examples/x.py} and `1.003`{out=examples/x.py}\n"
    folder = make(
        "## Swing\n\n" + block("x.py", code, "period 2.006 s\nhalf 1.003 s") + prose, again
    )
    with serve_preview(folder) as preview, preview.events() as events:
        events.until(lambda page: any(o.get("offer") for o in page.news["outputs"]))
        assert events.news["numbers"] == []  # the recorded outputs confirm them
        assert preview.accept_offer(events.news["outputs"][0]["offer"]) == (200, {"message": ""})
        events.wait_until_settled()
        assert prose.replace("2.006", "2.950") in folder.text(folder.lesson())
        expected = again.replace("2.01", "2.95").replace("1.003", "1.975")
        assert folder.text(folder.lesson(2)) == expected
    assert folder.main("undo").status == 0
    assert folder.text(folder.lesson(2)) == again


HESITANT = fixture_text("scripts/hesitant.txt")
"""The command with a pause between looking a value up and remembering where it is printed."""


@pytest.mark.parametrize("command", ["", HESITANT], ids=["", "while judged"])
def test_other_words_around_the_same_numbers_keep_every_address(make: Make, command: str) -> None:
    """Accepted in one lesson, of whose script another shows a number; then updated."""
    code = "print('period', 2.95, 's')\nprint('half', 2.95, 's')"
    prose = '`2.950 s`{out="period"} and `2.950`{out="half"}\n'
    again = '## Again\n\n`2.95`{out=examples/x.py "period"}, `2.9500`{out=examples/x.py "half"}\n'
    plain = re.sub(r' ?"\w+"|="\w+"', "", again)
    text = "## Swing\n\n" + block("x.py", code, "period 2.95 s\nhalf 2.95 s")
    folder = make(text + prose, again)
    assert folder.main("check").status == 0
    folder.write(folder.lesson(2), plain)  # the words are known from now on by the record
    folder.replace(folder.lesson(), prose, re.sub('="[a-z]+"', "", prose))
    folder.replace(folder.lesson(), "'period'", "'whole'")
    with serve_preview(folder, code=command) as preview, preview.events() as events:
        assert preview.accept_offer(events.offered()[0]["offer"]) == (200, {"message": ""})
        events.wait_until_settled()
    assert folder.main("check").status == 0
    folder.replace(folder.lesson(), "'half'", "'every other'")
    assert folder.main("update", "1.1").status == 0
    assert folder.main("check").status == 0
    text = folder.text(folder.lesson())
    for old, new in (
        ("'whole', 2.95, 's')\nprint('every other'", "'every third', 2.95, 's')\nprint('whole'"),
        ("'whole', 2.95", "'all', 2.96"),
    ):  # lines that may have changed places; another number
        folder.write(folder.lesson(), text.replace(old, new))
        result = folder.main("update")
        assert result.status == 1
        assert "is no longer printed" in result.out
        folder.write(folder.lesson(), text)


def test_words_that_come_to_stand_for_another_number_write_nothing(make: Make) -> None:
    """The title of a column stands by chance above a number of another line."""
    printed = ("nudge  form  difference", "0.1  2.5  +3e-10", "slope is -0.5 s")
    code = "\n".join(map("print({!r})".format, printed))
    text = block("x.py", code, "\n".join(printed)) + '`+3e-10`{out="difference"}\n'
    folder = make("## Swing\n\n" + text)
    assert folder.main("check").status == 0
    folder.replace(folder.lesson(), "difference')", "difference  (s)')")
    assert folder.main("update").status == 1
    assert '\n`+3e-10`{out="difference"}\n' in folder.text(folder.lesson())


def test_a_number_that_is_printed_twice_offers_its_words(make: Make) -> None:
    code = "print('measured', 2.5, 'formula', 2.5)"
    folder = make("## Swing\n\n" + block("x.py", code, "measured 2.5 formula 2.5") + "`2.5`{out}\n")
    with serve_preview(folder) as preview, preview.events() as events:
        events.until(lambda page: any(p["choices"] for p in page.news["problems"]))
        (problem,) = events.news["problems"]
        _, second = problem["choices"]
        assert second["text"].startswith('`{out="formula"}` chooses ')
        assert preview.accept_offer(second["offer"]) == (200, {"message": ""})
        events.wait_until_settled()
        assert '`2.5`{out="formula"}\n' in folder.text(folder.lesson())
