"""What an installation without extras lacks is said by the command that needs it."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from support.scratch_course import Folder

MOTION = """\
## Ball

```lab ode
{"title": "A ball", "t": {"max": 1, "unit": "s"},
 "states": {"h": {"start": 1, "rate": "v"}, "v": {"start": 0, "rate": "-9.81"}},
 "plots": [{"ylabel": "height (m)", "traces": [{"label": "height", "expr": "h"}]}]}
```
"""
PICTURE = """\
## Dot

```python file=examples/dot.py figure=dot.png
import struct
import zlib
from pathlib import Path


def chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


header = struct.pack(">IIBBBBB", 1, 1, 8, 0, 0, 0, 0)
chunks = chunk(b"IHDR", header), chunk(b"IDAT", zlib.compress(bytes(2))), chunk(b"IEND", b"")
Path("dot.png").write_bytes(bytes.fromhex("89504e470d0a1a0a") + b"".join(chunks))
```

Figure: ![A dot](dot.png) A dot.
"""
FORMULA = """\
## Sine

```lab plot
{"title": "A sine", "x": {"max": 6},
 "plots": [{"ylabel": "height (m)", "traces": [{"label": "height", "expr": "sin(x)"}]}]}
```
"""


@pytest.mark.engine
@pytest.mark.parametrize(
    ("package", "lesson", "command", "message"),
    [
        (
            "scipy",
            MOTION,
            "check",
            "a trial of a lab's equations needs the package scipy\n"
            "  help: run `pip install 'coursebuild[measure]'`\n",
        ),
        (
            "scipy",
            FORMULA,
            "bench",
            "`coursebuild bench` needs the package scipy\n"
            "  help: run `pip install 'coursebuild[measure]'`\n",
        ),
        (
            "scipy",
            FORMULA,
            "stability",
            "`coursebuild stability` needs the package scipy\n"
            "  help: run `pip install 'coursebuild[measure]'`\n",
        ),
        (
            "PIL",
            PICTURE,
            "update",
            "`dot.png` needs the package Pillow: run `pip install 'coursebuild[figures]'`\n",
        ),
    ],
)
def test_command_names_the_extra_that_it_needs(
    package: str,
    lesson: str,
    command: str,
    message: str,
    tmp_path: Path,
    stores: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    folder = Folder(tmp_path / "course")
    folder.fill([lesson], stores)
    monkeypatch.setitem(sys.modules, package, None)
    result = folder.main(command, "--quiet")
    assert message in result.out + result.err
    assert result.status == 1


@pytest.mark.engine
def test_lab_of_formulas_and_build_need_no_extra(
    tmp_path: Path, stores: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = Folder(tmp_path / "course")
    folder.fill([FORMULA], stores)
    for package in ("scipy", "matplotlib", "PIL", "pygls", "fsspec"):
        monkeypatch.setitem(sys.modules, package, None)
    result = folder.main("build")
    assert result.status == 0, result.out + result.err
    assert (folder.root / "public/index.html").is_file()
