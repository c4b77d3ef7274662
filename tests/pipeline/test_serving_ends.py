"""`serve` ends cleanly, whatever it does at the moment."""

from __future__ import annotations

import signal
import subprocess
from collections.abc import Callable

import pytest

from support.preview_process import serving, wait_for
from support.scratch_course import GOOD, SILENT, Folder, block, ended, wait_until_alone

Make = Callable[..., Folder]
pytestmark = pytest.mark.site


def test_preview_that_is_interrupted_ends_cleanly(make: Make) -> None:
    folder = make(GOOD)
    pruned = folder.root / ".coursebuild" / "pruned"
    with (
        serving(folder, "--cache-size", "1K", env=SILENT) as preview,
        preview.events() as events,
    ):
        preview.heard("checked: ")
        assert not pruned.exists()
        preview.process.send_signal(signal.SIGINT)
        preview.stopped()
        for _ in events.stream:  # it ends
            pass
        assert preview.process.stdout is not None and preview.process.stdout.read() == b""
        port = preview.port
    assert list(folder.tmp.iterdir()) == []
    assert pruned.exists(), "what is kept stays within its bound for who only previews as well"
    # The port is free again.
    process = folder.start("serve", "--port", str(port), stderr=subprocess.PIPE)
    with ended(process):
        assert process.stderr is not None
        assert process.stderr.readline().startswith(b"serving http://127.0.0.1:%d/" % port)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_scripts_end_with_the_preview(make: Make, number: int) -> None:
    slow = "import time, pathlib\npathlib.Path('begun').touch()\nwhile True: time.sleep(60)"
    folder = make("## One\n\n" + block("x.py", slow))
    with serving(folder) as preview:
        wait_for(folder.root / "begun")
        preview.process.send_signal(number)
        status = preview.process.wait(600)
        assert status == (-number if number == signal.SIGKILL else 0)
    wait_until_alone(folder)


def test_preview_that_is_ended_while_the_course_is_read_ends_cleanly(make: Make) -> None:
    folder = make(*(GOOD.replace("hello.py", f"hello{n}.py") + "$x$\n" * 500 for n in range(6)))
    with serving(folder, env=SILENT) as preview:  # it has said where it will serve
        preview.process.send_signal(signal.SIGTERM)
        preview.stopped()
