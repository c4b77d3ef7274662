"""`serve`: saves of every kind, the news for open pages, and how it ends."""

from __future__ import annotations

import signal
import subprocess
from pathlib import Path

import pytest

from support.preview_process import PATIENT, serve_preview
from support.scratch_course import (
    GOOD,
    SILENT,
    WAIT_FOR_GO,
    Make,
    block,
    kill_at_end,
    wait_until_alone,
)
from support.waiting import wait_for_file

pytestmark = pytest.mark.site


def test_page_is_told_of_every_save(make: Make) -> None:
    folder = make(GOOD)
    page = "/lessons/1.1-one.html"
    with serve_preview(folder) as preview, preview.events() as events:
        events.wait_until_settled()
        assert events.news["scripts"] == [{"path": "examples/hello.py", "state": "ok"}]

        def shows(text: bytes) -> bool:
            return text in preview.get(page)[2]

        folder.replace(folder.lesson(), "## Hello\n", "## Hello again\n")
        events.wait_for_change()
        assert shows(b"Hello again")
        folder.replace(folder.lesson(), "3.14159\n```", "3.14158\n```")
        events.wait_until_settled("output-drift")
        assert shows(b"3.14158")  # the page is redrawn, and shows the mistake
        folder.replace(folder.lesson(), "## Hello again\n", "## Seen [x](lesson:9.9)\n")
        events.until(lambda page: "link-lesson" in page.rules())
        (link,) = (p for p in events.news["problems"] if p["rule"] == "link-lesson")
        assert shows(b"Seen x") and shows(f'id="{link["mark"]}"'.encode())
        with preview.events("index.html") as late:  # a page that is opened now gets the news, too
            late.until(lambda page: "link-lesson" in page.rules())
        folder.write(folder.lesson(), GOOD)
        events.wait_until_settled()
        assert shows(b"Hello") and not shows(b"Hello again")
        # The map is gone, and back.
        map_ = folder.read("content/course.toml")
        (folder.root / "content/course.toml").unlink()
        events.until(lambda page: "map-missing" in page.rules())
        assert shows(b"Hello")
        folder.write("content/course.toml", map_)
        events.wait_until_settled()


def test_terminal_tells_what_is_new_and_what_is_gone(make: Make) -> None:
    """Mistakes whose lines have moved are not new."""
    folder = make(GOOD)
    with serve_preview(folder, code=PATIENT) as preview:
        preview.wait_for_line("checked: everything holds")
        for text, mistakes, verdict in (
            ("[a](lesson:8.1)\n\n[b](lesson:8.2)\n", ["8.1", "8.2"], "2 errors (2 new)"),
            ("Text.\n\n[b](lesson:8.2)\n\n[c](#c)\n", ["link-anchor"], "2 errors (1 new, 1 gone)"),
            ("More.\n\nText.\n\n[b](lesson:8.2)\n\n[c](#c)\n", [], "still 2 errors"),
            ("", [], "everything holds"),
            ("Text.\n", [], "everything holds"),
        ):
            before = len(preview.lines)
            folder.write(folder.lesson(), GOOD + text)
            preview.wait_for_line(f"checked: {verdict}", before)
            lines = preview.lines[before:]
            new = [line for line in lines if line.startswith("error[")]
            assert len(new) == len(mistakes)
            assert all(mistake in line for mistake, line in zip(mistakes, new, strict=True))
            gone_lines = [line for line in lines if line.startswith(f"gone: {folder.lesson()}:")]
            assert len(gone_lines) == {"2 errors (1 new, 1 gone)": 1, "": 2}.get(
                verdict if text else "", 0
            )


def in_place(path: Path, text: str) -> None:
    path.write_text(text)


def in_pieces(path: Path, text: str) -> None:
    """Emptied first, then written bit by bit."""
    with path.open("w") as file:
        file.flush()
        for start in range(0, len(text), 20):
            file.write(text[start : start + 20])
            file.flush()


def with_a_backup(path: Path, text: str) -> None:
    """vim: the old file is moved away, a new one is written, the old one is removed."""
    backup = path.with_name(path.name + "~")
    path.rename(backup)
    path.write_text(text)
    backup.unlink()


def by_renaming(path: Path, text: str) -> None:
    fresh = path.with_name(f".#{path.name}.new")
    fresh.write_text(text)
    fresh.replace(path)


def gone_for_a_moment(path: Path, text: str) -> None:
    path.unlink()
    path.write_text(text)


def as_vim(path: Path, text: str) -> None:
    probe = path.with_name("4913")
    probe.touch()
    probe.unlink()
    path.with_name(f".{path.name}.swp").touch()
    path.with_name(f"{path.name}.swx").touch()
    with_a_backup(path, text)


def as_sed(path: Path, text: str) -> None:
    """By a file whose name is like any other, which is there for a moment."""
    fresh = path.with_name("sedA1b2C3")
    fresh.touch()
    fresh.write_text(text)
    fresh.rename(path)


SAVES = (in_place, in_pieces, with_a_backup, by_renaming, gone_for_a_moment, as_vim, as_sed)


def test_saves_of_every_editor_and_a_switched_branch_count_once_each(make: Make) -> None:
    folder = make(GOOD, *("## One\n\nText.\n" for _ in range(5)))
    pictures = [f"content/pics/{number}.svg" for number in range(300)]
    for path in pictures:
        folder.write(path, '<svg xmlns="http://www.w3.org/2000/svg"/>')
    with serve_preview(folder, code=PATIENT) as preview, preview.events() as events:
        events.wait_until_settled()
        for save in SAVES:
            name = save.__name__
            before = len(preview.lines)
            save(folder.root / folder.lesson(), GOOD.replace("## Hello", f"## {name}"))
            events.wait_for_change()
            assert name.encode() in preview.get("/lessons/1.1-one.html")[2], name
            events.wait_until_settled()
            lines = [line for line in preview.lines[before:] if not line.startswith("checked")]
            assert len(lines) == 1 and lines[0].startswith("changed: content/lessons/1.1-one.md (")
        before = len(preview.lines)
        for path in pictures:
            (folder.root / path).unlink()
        for number in range(1, 7):
            folder.write(folder.lesson(number), "## Two\n\nText.\n")
        events.wait_for_change()
        for page in ("1.1-one", "1.6-six"):
            assert b"Two" in preview.get(f"/lessons/{page}.html")[2]
        events.wait_until_settled()
        change_lines = [line for line in preview.lines[before:] if line.startswith("changed: ")]
        assert len(change_lines) == 1, change_lines


def test_pages_elsewhere_are_followed_and_two_browsers_told_alike(make: Make) -> None:
    folder = make(GOOD, "## Two\n\nText.\n")
    entry = '[[page]]\nid = "readme"\ntitle = "Page"\nfile = "README.md"\n'
    folder.write("content/course.toml", folder.text("content/course.toml") + entry)
    folder.write("README.md", "One.\n")
    with serve_preview(folder) as preview:
        with preview.events("readme.html") as events:  # a file outside of `content/`
            events.wait_until_settled()
            folder.write("README.md", "Two.\n")
            events.wait_for_change()
            assert b"Two." in preview.get("/readme.html")[2]
        with preview.events() as first, preview.events() as second:
            first.wait_until_settled()
            second.wait_until_settled()
            old = first.state
            assert old == second.state
            folder.replace(folder.lesson(), "## Hello", "## Both")
            assert first.wait_for_change().state == second.wait_for_change().state
        with preview.events("lessons/1.2-two.html") as second_page:
            second_page.wait_until_settled()
            folder.replace(folder.lesson(), "## Both", "## Later")
            with preview.events() as back:
                back.until(lambda page: page.state not in ("", old, first.state))
                back.wait_until_settled()
            second_page.wait_until_settled()
            assert second_page.pages == 1  # nothing of its own changed


def test_saves_while_scripts_run_are_taken_and_what_was_changed_is_not_waited_for(
    make: Make,
) -> None:
    code = f"open('begun', 'a').write('x')\n{WAIT_FOR_GO}print(1)"
    folder = make("## First\n\n" + block("x.py", code, "1", info="timeout=3000"))
    with serve_preview(folder) as preview, preview.events() as events:
        wait_for_file(folder.root / "begun")
        assert events.until(lambda page: bool(page.news["scripts"])).news["scripts"] == [
            {"path": "examples/x.py", "state": "running"}
        ]
        # It continues while another file is saved.
        folder.replace(folder.lesson(), "## First", "## Second")
        events.until(lambda page: b"Second" in preview.get("/lessons/1.1-one.html")[2])
        folder.write("go", "")
        events.wait_until_settled("script-writes")
        assert events.news["scripts"] == [{"path": "examples/x.py", "state": "ok"}]
        assert folder.read("begun") == b"x"
        (folder.root / "go").unlink()
        folder.replace(folder.lesson(), "print(1)", "print(int(1))")
        wait_for_file(folder.root / "begun", 2)
        events.until(lambda page: page.news["scripts"][0]["state"] == "running")
        folder.replace(folder.lesson(), WAIT_FOR_GO, "")
        events.wait_until_settled("script-writes")
        assert events.news["scripts"] == [{"path": "examples/x.py", "state": "ok"}]
        assert folder.read("begun") == b"xxx"


def test_what_a_script_prints_is_shown_while_others_run(make: Make) -> None:
    reads = "print(open('models/data.txt').read())"
    folder = make("## A\n\n" + block("a.py", reads, "1") + block("b.py", WAIT_FOR_GO + reads, "1"))
    folder.write("models/data.txt", "1")
    folder.write("go", "")
    with serve_preview(folder, "--jobs", "2") as preview, preview.events() as events:
        events.wait_until_settled()
        (folder.root / "go").unlink()
        folder.write("models/data.txt", "2")
        events.until(lambda page: page.news["outputs"][0]["state"] == "drift")
        assert events.news["outputs"][1]["state"] == "verified"  # with what is known
        folder.write("go", "")
        events.wait_until_settled("output-drift", "output-drift")
        assert all(output["offer"] for output in events.news["outputs"])


def test_course_that_is_wrong_from_the_beginning(make: Make) -> None:
    folder = make(GOOD + "[gone](lesson:7.7)\n")
    good = folder.read("content/course.toml")
    folder.write("content/course.toml", "[course\n")
    page = "/lessons/1.1-one.html"
    with serve_preview(folder) as preview, preview.events() as events:
        events.until(lambda page: "map-syntax" in page.rules())
        status, _, body = preview.get("/")
        assert status == 404
        assert b"Nothing has been built yet." in body and b"/.coursebuild/preview.js" in body
        folder.write("content/course.toml", good)
        events.wait_until_settled("link-lesson")
        status, _, body = preview.get(page)
        assert status == 200
        assert b"gone" in body and b"/.coursebuild/preview.js" in body
        assert b"Scratch" in preview.get("/")[2]
        folder.write(folder.lesson(), GOOD)
        events.wait_until_settled()
        assert b"hello 3.14159" in preview.get(page)[2]
    assert not (folder.root / "public").exists()


# --- how it ends


def test_preview_that_is_interrupted_ends_cleanly(make: Make) -> None:
    folder = make(GOOD)
    pruned = folder.root / ".coursebuild" / "pruned"
    with (
        serve_preview(folder, "--cache-size", "1K", env=SILENT) as preview,
        preview.events() as events,
    ):
        preview.wait_for_line("checked: ")
        assert not pruned.exists()
        preview.process.send_signal(signal.SIGINT)
        preview.check_interrupted()
        for _ in events.stream:  # it ends
            pass
        assert preview.process.stdout is not None and preview.process.stdout.read() == b""
        port = preview.port
    assert list(folder.tmp.iterdir()) == []
    assert pruned.exists(), "what is kept stays within its bound for who only previews as well"
    # The port is free again.
    process = folder.start("serve", "--port", str(port), stderr=subprocess.PIPE)
    with kill_at_end(process):
        assert process.stderr is not None
        serving_ = b"serving http://127.0.0.1:%d/" % port
        assert any(line.startswith(serving_) for line in process.stderr)


def test_scripts_end_with_a_preview_that_is_killed(make: Make) -> None:
    slow = "import time, pathlib\npathlib.Path('begun').touch()\nwhile True: time.sleep(60)"
    folder = make("## One\n\n" + block("x.py", slow))
    with serve_preview(folder) as preview:
        wait_for_file(folder.root / "begun")
        preview.process.kill()
        assert preview.process.wait(600) == -signal.SIGKILL


def test_preview_that_is_ended_while_the_course_is_read_ends_cleanly(make: Make) -> None:
    folder = make(*(GOOD.replace("hello.py", f"hello{n}.py") + "$x$\n" * 500 for n in range(6)))
    process = folder.start("serve", "--port", "0", env=SILENT, stderr=subprocess.PIPE)
    with kill_at_end(process):
        assert process.stderr is not None
        assert process.stderr.readline() == b"reading lessons and pages\n"
        process.terminate()
        assert process.stderr.read().endswith(b"terminated\n")
        assert process.wait(600) == 143
    wait_until_alone(folder)
