"""Guessing whether scripts will run."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from coursebuild.core.engine.memo import Memo
from coursebuild.core.model.results import Outcome, ScriptJob
from coursebuild.core.run.prewarm import prewarmed_runner, scripts_will_run

CODE = "import mujoco\nprint(6 * 7)\n"


def text(info: str = "python file=examples/a.py", fence: str = "```") -> str:
    return f"# A lesson\n\nWords.\n\n{fence}{info}\n{CODE}{fence}\n\nOutput:\n\n```text\n42\n```\n"


@pytest.fixture
def root(tmp_path: Path) -> Path:
    (tmp_path / "content/lessons").mkdir(parents=True)
    (tmp_path / "examples").mkdir()
    return tmp_path


def write(root: Path, text: str, name: str = "1.1-a.md") -> None:
    (root / "content/lessons" / name).write_bytes(text.encode())


def known(root: Path) -> Memo:
    """A store in which there are results."""
    (root / ".coursebuild/scripts").mkdir(parents=True, exist_ok=True)
    return Memo(root)


def test_where_nothing_is_known_any_script_will_run(root: Path) -> None:
    assert not scripts_will_run(root, Memo(root))
    (root / "examples/a.py").write_text(CODE)
    for fence in ("```", "````", "~~~"):
        for end in ("\n", "\r\n"):
            write(root, text(fence=fence).replace("\n", end))
            assert scripts_will_run(root, Memo(root)), (fence, end)
            assert not scripts_will_run(root, known(root)), (fence, end)
            assert scripts_will_run(root, Memo(root, fresh=True)), (fence, end)
            (root / ".coursebuild/scripts").rmdir()


def test_where_there_is_no_script_none_will_run(root: Path) -> None:
    for lesson in (
        "",
        text(info="python"),
        text(info="python file=elsewhere.py"),
        text(info="pythonic file=examples/a.py"),
        "```python file=examples/a.py\nno end",
    ):
        write(root, lesson)
        assert not scripts_will_run(root, Memo(root)), lesson


def test_a_script_that_was_changed_will_run(root: Path) -> None:
    store = known(root)
    write(root, text())
    assert scripts_will_run(root, store)
    (root / "examples/a.py").write_text(CODE)
    assert not scripts_will_run(root, store)
    write(root, text() + "More words.\n")
    assert not scripts_will_run(root, store)
    write(root, text().replace("6 * 7", "7 * 6"))
    assert scripts_will_run(root, store)


def test_any_bytes(root: Path) -> None:
    (root / "content/lessons/1.1-a.md").write_bytes(b"```python file=examples/\xff.py\n\xff\n```\n")
    (root / "content/lessons/1.2-b.md").mkdir()
    (root / "content/lessons/1.3-c.md").symlink_to("nowhere")
    os.mkfifo(root / "content/lessons/1.4-d.md")
    assert not scripts_will_run(root, Memo(root))
    write(root, text(), "1.5-e.md")
    os.mkfifo(root / "examples/a.py")
    assert scripts_will_run(root, known(root))


def test_they_are_run_by_what_was_begun(root: Path) -> None:
    write(root, text())
    (root / "examples/a.py").write_text("print(6 * 7)\n")
    job = ScriptJob("examples/a.py", (), 20.0, (), norun=False)
    with prewarmed_runner(root, Memo(root)) as run_all:
        assert run_all is not None
        [run] = run_all(root, [job], parallel=2)
        assert (run.outcome, run.stdout) == (Outcome.OK, "42\n")
    write(root, "")
    with prewarmed_runner(root, known(root)) as run_all:
        assert run_all is None
