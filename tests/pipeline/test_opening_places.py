"""A place where something is wrong opens in the author's editor."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from coursebuild.preview.server import open_in_editor
from support.live_course import Live
from support.live_course import live as live
from support.scratch_course import Folder, Make

pytestmark = pytest.mark.site


def test_place_opens_in_each_kind_of_editor(
    make: Make,
    live: Callable[[Folder], Live],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    folder = make("## One\n\nSee [x](lesson:9.9).\n")
    session = live(folder).session
    place = f"{folder.lesson()}:3:9"
    file = folder.root.resolve() / folder.lesson()
    bin, calls = tmp_path / "bin", tmp_path / "told"
    bin.mkdir()
    monkeypatch.setenv("PATH", str(bin))

    def arguments_of_editor(visual: str, editor: str = "") -> list[str]:
        monkeypatch.setenv("VISUAL", visual)
        monkeypatch.setenv("EDITOR", editor)
        calls.unlink(missing_ok=True)
        assert open_in_editor(session, place) == ""
        return calls.read_text().splitlines()

    def install(name: str, ends: int = 0) -> None:
        (bin / name).write_text(f'#!/bin/sh\nprintf "%s\\n" {name} "$@" > "{calls}"\nexit {ends}\n')
        (bin / name).chmod(0o755)

    assert open_in_editor(session, place) == (
        "no editor that opens a window was found: set VISUAL to one, such as `code`"
    )
    for name in ("code", "subl", "pycharm", "emacsclient", "gvim", "vim"):
        install(name)
    assert arguments_of_editor("code --wait") == ["code", "--wait", "--goto", f"{file}:3:9"]
    assert arguments_of_editor("", str(bin / "subl")) == ["subl", f"{file}:3:9"]
    assert arguments_of_editor("pycharm") == ["pycharm", "--line", "3", "--column", "9", str(file)]
    assert arguments_of_editor("emacsclient -n") == ["emacsclient", "-n", "+3:9", str(file)]
    assert arguments_of_editor("vim", "gvim") == ["gvim", "+3", str(file)]
    assert arguments_of_editor("vim", "not-there") == ["code", "--goto", f"{file}:3:9"]
    calls.unlink()
    for other_place in (f"{folder.lesson()}:3:8", "content/course.toml:1:1", "/etc/passwd:1:1", ""):
        assert open_in_editor(session, other_place) == "nothing is wrong there any more"
    assert not calls.exists()
    install("gvim", ends=3)
    monkeypatch.setenv("VISUAL", "gvim")
    assert open_in_editor(session, place) == "gvim ended with status 3"
