"""The tutorial works: its files are written and its commands run, in its order.

The info string of a fence says what to do with it:

- `file=PATH`, `append=PATH`: what the author writes; `shows=PATH`: what the file holds then.
- `sh`: commands. `mistake=OLD→NEW in=PATH` is an edit with which they fail, undone afterwards, and
  `replace=` an edit that stays; both change the last match. `sh later` is not run here.
- `prints`: the output of the command above.
"""

from __future__ import annotations

import re
import shlex
import subprocess
from pathlib import Path
from urllib.request import HTTPCookieProcessor, build_opener

import pytest

from support.markdown_files import DOCS, Fence, fences
from support.scratch_course import CommandResult, Folder

pytestmark = pytest.mark.site


def test_the_tutorial_leads_to_a_published_course(tmp_path: Path) -> None:
    folder, result = Folder(tmp_path), CommandResult(0, "", "")
    for fence in fences(DOCS / "tutorial.md"):
        if fence.is_("prints"):
            assert fence.text in result.out
        elif fence.kind == "sh" and not fence.is_("later"):
            folder, result = run_fence(folder, fence)
        elif path := fence.value("file"):
            folder.write(path, fence.text)
        elif path := fence.value("append"):
            folder.write(path, f"{folder.text(path)}\n{fence.text}")
        elif path := fence.value("shows"):
            assert fence.text in folder.text(path)
    page = folder.text("public/lessons/1.3-free-fall.html")
    assert "the ball touches the floor after 0.322 s" in page
    assert 'class="lab"' in page
    assert "1.3-check" in page


def run_fence(folder: Folder, fence: Fence) -> tuple[Folder, CommandResult]:
    """Run the commands of a fence; return the folder after them, and the result of the last."""
    path, mistake, edit = fence.value("in"), fence.value("mistake"), fence.value("replace")
    before = folder.text(path) if path else ""
    if path:
        old, _, new = (mistake or edit or "").partition("→")
        head, match, tail = before.rpartition(old)
        assert match
        folder.write(path, head + new + tail)
    result = CommandResult(0, "", "")
    for line in fence.text.splitlines():
        program, *words = shlex.split(line)
        if program == "cd":
            folder = Folder(folder.root / words[0])
            folder.tmp.mkdir()
        elif words[0] == "serve":
            look_at(folder)
        else:
            assert program == "coursebuild"
            result = folder.main(*words)
            assert result.status == (1 if mistake else 0), result.out + result.err
    if path and mistake:
        folder.write(path, before)
    return folder, result


def look_at(folder: Folder) -> None:
    """Assert that the preview shows the course at the address that it prints."""
    server = folder.start("serve", "--port", "0", stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    try:
        assert server.stdout is not None
        lines = iter(server.stdout.readline, b"")
        address = next(match[0] for line in lines if (match := re.search(rb"http://\S+", line)))
        browser = build_opener(HTTPCookieProcessor())
        browser.open(address.decode()).close()
        with browser.open(address.decode().partition("?")[0]) as page:
            assert b"A first course" in page.read()
    finally:
        server.terminate()
        server.communicate()
