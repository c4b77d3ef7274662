"""What follows a save in a preview: nothing of it is done twice, and what fails is tried again."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from coursebuild.effects.errors import EffectError
from coursebuild.pipeline.preview import behind as module
from coursebuild.pipeline.preview.behind import Behind
from coursebuild.pipeline.preview.scripts import SupersededError
from coursebuild.scripts import bindings
from support.live_course import Live
from support.live_course import live as live
from support.scratch_course import GOOD, Folder, block

pytestmark = pytest.mark.site

Make = Callable[..., Folder]
Start = Callable[[Folder], Live]


def append(folder: Folder, text: str) -> str:
    """Add to the lesson; gives its path."""
    path = folder.lesson()
    folder.write(path, folder.text(path) + text)
    return path


def counted(monkeypatch: pytest.MonkeyPatch, owner: object, name: str) -> list[object]:
    """The calls of a function from now on."""
    calls: list[object] = []
    real = getattr(owner, name)

    def call(*given: object, **named: object) -> object:
        calls.append(given)
        return real(*given, **named)

    monkeypatch.setattr(owner, name, call)
    return calls


def test_a_save_while_it_works_does_not_make_it_read_everything_again(
    make: Make, live: Start, monkeypatch: pytest.MonkeyPatch
) -> None:
    one = live(make(GOOD))
    reread = counted(monkeypatch, one.course, "reread")
    draw = Behind._draw
    edits = iter(range(3))

    def interrupted(self: Behind, most: int | None) -> None:
        if (number := next(edits, None)) is not None:
            assert one.save(append(one.folder, f"\nRevision {number}.\n"))
            self._check()
        draw(self, most)

    monkeypatch.setattr(Behind, "_draw", interrupted)
    for _ in range(3):
        with pytest.raises(SupersededError):
            one.behind.once()
    one.behind.once()
    assert len(reread) == 1
    (path,) = (p for p in one.course.pages.paths() if p.startswith("lessons/1.1") and ".html" in p)
    assert b"Revision 2." in (one.course.find(path) or b"")


def test_what_was_noticed_while_it_works_is_looked_at(
    make: Make, live: Start, monkeypatch: pytest.MonkeyPatch
) -> None:
    one = live(make(GOOD))
    one.behind.once()
    reread = counted(monkeypatch, one.course, "reread")
    compiled = counted(monkeypatch, module, "compile_models")
    one.behind.notice()
    with monkeypatch.context() as meanwhile:
        busy = one.behind._busy

        def noticed(what: str) -> None:
            one.behind.notice()
            busy(what)

        meanwhile.setattr(one.behind, "_busy", noticed)
        with pytest.raises(SupersededError):
            one.behind.once()
    assert (len(reread), len(compiled)) == (1, 0)
    one.behind.once()
    assert (len(reread), len(compiled)) == (2, 1)
    one.behind.once()
    assert (len(reread), len(compiled)) == (2, 1)


def test_a_script_that_did_not_run_again_before_a_save_does_so_after_it(
    make: Make, live: Start, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One that imports another leans on its text, whatever happens in between."""
    folder = make(
        block("first.py", 'print("one")\nVALUE = 1', "one")
        + block("second.py", "import first\nprint(first.VALUE)", "one\n1")
    )
    one = live(folder)
    one.behind.once()
    assert one.wrong() == []
    folder.replace(folder.lesson(), "VALUE = 1", "VALUE = 2")
    assert one.save(folder.lesson())
    run = one.behind._scripts._run

    def interrupted(batch: object, **named: bool) -> None:
        run(batch, **named)  # type: ignore[arg-type]
        monkeypatch.undo()
        raise SupersededError

    monkeypatch.setattr(one.behind._scripts, "_run", interrupted)
    with pytest.raises(SupersededError):
        one.behind.once()
    one.behind.once()
    assert one.wrong() == ["output-drift"]


def test_numbers_are_looked_for_where_something_changed(
    make: Make, live: Start, monkeypatch: pytest.MonkeyPatch
) -> None:
    bound = block("a.py", "print(1.25)", "1.25") + "\nIt is `1.25`{out}.\n"
    one = live(make(bound))
    looked = counted(monkeypatch, bindings, "_check")
    one.behind.once()
    assert one.save(append(one.folder, "\nMore.\n"))
    one.behind.once()
    assert (len(looked), one.wrong()) == (1, [])
    one.folder.replace(one.folder.lesson(), "`1.25`{out}", "`1.26`{out}")
    assert one.save(one.folder.lesson())
    for _ in range(2):
        one.behind.once()
        assert one.wrong() == ["binding-mismatch"]


def test_what_fails_is_said_once_and_tried_again(
    make: Make, live: Start, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    one = live(make(GOOD))
    once = one.behind.once
    tries = 0

    def failing() -> None:
        nonlocal tries
        tries += 1
        if tries < 4:
            raise EffectError("the disk is full")
        once()
        one.behind.fail(KeyboardInterrupt())

    monkeypatch.setattr(one.behind, "once", failing)
    monkeypatch.setattr(module, "QUIET", 0.01)
    monkeypatch.setattr(module, "_RETRY", 0.05)
    with pytest.raises(KeyboardInterrupt):
        one.behind.follow()
    assert tries == 4
    assert capsys.readouterr().err.count("coursebuild: the disk is full\n") == 1
    assert one.course.trouble == ""


def test_reading_that_failed_is_made_up_for(
    make: Make, live: Start, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also where an edit alone was the reason for it."""
    one = live(make(GOOD))
    one.behind.once()
    one.folder.replace(one.folder.lesson(), "## Hello", "## Hello\n\n[nowhere](#nowhere)\n\n##")
    assert one.save(one.folder.lesson())
    assert one.course.due
    with monkeypatch.context() as failing:

        def fail(*_: object) -> None:
            raise EffectError("the disk is gone")

        failing.setattr("coursebuild.pipeline.preview.live.load", fail)
        with pytest.raises(EffectError):
            one.behind.once()
    read = counted(monkeypatch, one.course, "reread")
    one.behind.once()
    one.behind.once()
    assert len(read) == 1
