"""Importing what scripts need before it is known whether any will run.

Entry point: `prewarmed_runner`, which begins to import that while the texts are read and parsed.

It is a guess, made from a look at the texts that were saved last. Where it is wrong, a process was
started in vain, or is started when scripts are run; nothing else depends on it.
"""

from __future__ import annotations

import contextlib
import heapq
import os
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TypeAlias

from coursebuild.core.engine.memo import Memo
from coursebuild.core.model.results import ScriptRun

RunAll: TypeAlias = Callable[..., tuple[ScriptRun, ...]]
"""Runs scripts, as `runner.run_scripts` does."""

_PACKAGES = ("numpy", "mujoco")
_SCRIPT = re.compile(
    rb"^(`{3,}|~{3,})python[ \t](?:[^\n]*[ \t])?file=(examples/[\w./-]+\.py)(?:[ \t][^\n]*)?\n"
    rb"(.*?)^\1",
    re.MULTILINE | re.DOTALL,
)
"""A script as nearly all stand in a text: its path, and its code."""
_LATEST = 4
"""Texts that are looked at."""


@contextlib.contextmanager
def prewarmed_runner(root: Path, store: Memo) -> Iterator[RunAll | None]:
    """What runs scripts, once, where some are likely to be run.

    It has begun to import what they need, and is closed when it has run them, or in the end.
    """
    if not scripts_will_run(root, store):
        yield None
        return
    from coursebuild.core.run.runner import ScriptServer

    with ScriptServer() as server:
        server.expect(_PACKAGES)

        def run(*args: Any, **keywords: Any) -> tuple[ScriptRun, ...]:
            try:
                return server.run(*args, **keywords)
            finally:
                server.close()

        yield run


def scripts_will_run(root: Path, store: Memo) -> bool:
    """Whether there is a script that is not what `examples/` holds, or no result is to be used."""
    found = [
        (root / os.fsdecode(path), code)
        for text in heapq.nlargest(_LATEST, _texts(root / "content"))
        for _, path, code in _SCRIPT.findall(_read(text[1]).replace(b"\r\n", b"\n"))
    ]
    nothing_kept = store.shared is None and not (store.folder / "scripts").is_dir()
    return any(
        store.fresh or nothing_kept or _read(path).rstrip(b"\n") != code.rstrip(b"\n")
        for path, code in found
    )


def _texts(content: Path) -> Iterator[tuple[int, Path]]:
    """The lessons and pages, each after when it was saved."""
    for folder in ("lessons", "pages"):
        for path in (content / folder).glob("*.md"):
            with contextlib.suppress(OSError):
                yield path.stat().st_mtime_ns, path


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes() if path.is_file() else b""  # a pipe has no end
    except OSError:
        return b""
