"""The tutorial does what it says: its files are written and its commands run, in its order.

What a fence is for stands behind its kind:

- `file=PATH`, `append=PATH`: what the author writes; `shows=PATH`: what then stands in the file.
- `sh`: commands. `mistake=OLD→NEW in=PATH` is an edit with which they fail and that is undone, and
  `replace=` one that stays; both change the last place. `sh later` is not run here.
- `prints`: what the command above it says.
"""

from __future__ import annotations

import re
import shlex
import subprocess
from pathlib import Path
from urllib.request import urlopen

import pytest

from support.markdown_files import DOCS, Fence, fences
from support.scratch_course import CommandResult, Folder

pytestmark = pytest.mark.site


def test_the_tutorial_leads_to_a_published_course(tmp_path: Path) -> None:
    folder, done = Folder(tmp_path), CommandResult(0, "", "")
    for fence in fences(DOCS / "tutorial.md"):
        if fence.is_("prints"):
            assert fence.text in done.out
        elif fence.kind == "sh" and not fence.is_("later"):
            folder, done = walked(folder, fence)
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


def walked(folder: Folder, fence: Fence) -> tuple[Folder, CommandResult]:
    """The folder in which the commands end, and what the last of them did."""
    path, mistake, edit = fence.value("in"), fence.value("mistake"), fence.value("replace")
    before = folder.text(path) if path else ""
    if path:
        old, _, new = (mistake or edit or "").partition("→")
        head, found, tail = before.rpartition(old)
        assert found
        folder.write(path, head + new + tail)
    done = CommandResult(0, "", "")
    for line in fence.text.splitlines():
        program, *words = shlex.split(line)
        if program == "cd":
            folder = Folder(folder.root / words[0])
            folder.tmp.mkdir()
        elif words[0] == "serve":
            look_at(folder)
        else:
            assert program == "coursebuild"
            done = folder.main(*words)
            assert done.status == (1 if mistake else 0), done.out + done.err
    if path and mistake:
        folder.write(path, before)
    return folder, done


def look_at(folder: Folder) -> None:
    """The preview shows the course at the address that it prints."""
    server = folder.start("serve", "--port", "0", stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    try:
        assert server.stdout is not None
        lines = iter(server.stdout.readline, b"")
        address = next(found[0] for line in lines if (found := re.search(rb"http://\S+/", line)))
        with urlopen(address.decode()) as page:
            assert b"A first course" in page.read()
    finally:
        server.terminate()
        server.communicate()
