"""`serve` ends cleanly, whatever it does at the moment."""

from __future__ import annotations

import signal
import subprocess
import time
from collections.abc import Callable

import pytest

from support.preview_process import serving
from support.scratch_course import GOOD, SILENT, Folder, block, ended, wait_until_alone

Make = Callable[..., Folder]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_it_ends_cleanly(make: Make, number: int) -> None:
    folder = make(GOOD)
    with serving(folder, env=SILENT) as preview, preview.events() as events:
        preview.heard("checked: ")
        preview.process.send_signal(number)
        assert preview.process.wait(120) == 0
        for _ in events.stream:  # it ends
            pass
        preview._reader.join(60)
        assert preview.said[-1] == "stopped"
        assert "Traceback" not in "\n".join(preview.said)
        assert preview.process.stdout is not None and preview.process.stdout.read() == b""
    assert list(folder.tmp.iterdir()) == []


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_it_ends_while_scripts_run(make: Make, number: int) -> None:
    slow = "import time, pathlib\npathlib.Path('begun').touch()\ntime.sleep(60)"
    folder = make("## One\n\n" + block("x.py", slow))
    with serving(folder) as preview:
        until = time.monotonic() + 120
        while not (folder.root / "begun").exists():
            assert time.monotonic() < until
            time.sleep(0.01)
        preview.process.send_signal(number)
        status = preview.process.wait(120)
        assert status == (-number if number == signal.SIGKILL else 0)
    wait_until_alone(folder)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_it_ends_while_the_course_is_read(make: Make, number: int) -> None:
    folder = make(*(GOOD.replace("hello.py", f"hello{n}.py") + "$x$\n" * 500 for n in range(6)))
    with serving(folder, env=SILENT) as preview:  # it has said where it will serve
        preview.process.send_signal(number)
        assert preview.process.wait(120) == 0
        preview._reader.join(60)
        assert preview.said[-1] == "stopped"
        assert "Traceback" not in "\n".join(preview.said)


def test_what_is_kept_stays_within_its_bound(make: Make) -> None:
    """Also for an author who does nothing but preview."""
    folder = make(GOOD)
    with serving(folder, "--cache-size", "1K", env=SILENT) as preview:
        preview.heard("checked: ")
        assert not (folder.root / ".coursebuild" / "pruned").exists()
        preview.process.send_signal(signal.SIGINT)
        assert preview.process.wait(600) == 0
    assert (folder.root / ".coursebuild" / "pruned").exists()


def test_the_port_is_free_again(make: Make) -> None:
    folder = make(GOOD)
    with serving(folder) as preview:
        preview.heard("ready: ")
        preview.get("/")
        port = preview.port
        preview.process.send_signal(signal.SIGINT)
        assert preview.process.wait(120) == 0
    process = folder.start("serve", "--port", str(port), stderr=subprocess.PIPE)
    with ended(process):
        assert process.stderr is not None
        assert process.stderr.readline().startswith(b"serving http://127.0.0.1:%d/" % port)
