"""Whether scripts will run, guessed before the course is read, and what they will import.

Entry point: `early_server`, which begins to import that while the texts are read and parsed.

It is a guess, made from a look at a few texts. Where it is wrong, a process was started in vain, or
is started when scripts are run; nothing else depends on it.

1. Where nothing is remembered, or nothing is to be, any script will run.
2. Otherwise that of a text saved lately will, if it is not what `examples/` holds: its author
   has just written it.
"""

from __future__ import annotations

import contextlib
import heapq
import os
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TypeAlias

from coursebuild.effects.store import Store
from coursebuild.effects.surroundings import said_packages
from coursebuild.results import ScriptRun

RunAll: TypeAlias = Callable[..., tuple[ScriptRun, ...]]
"""Runs scripts, as `runner.run_scripts` does."""

_FENCE = re.compile(rb"^(`{3,}|~{3,})([^\n]*)\n", re.MULTILINE)
"""A fence at the margin, where nearly all scripts stand."""
_FILE = re.compile(rb"[ \t]file=(examples/[\w./-]+\.py)(?:[ \t]|$)")
_MOST_READ = 64
"""Texts that are looked at where any script will run."""
_LATEST = 4
"""Texts that are looked at where only one that was changed will."""


@contextlib.contextmanager
def early_server(root: Path, store: Store) -> Iterator[RunAll | None]:
    """What runs scripts, once, where some are likely to be run.

    It has begun to import what they need, and is closed when it has run them, or in the end.
    """
    packages = likely_packages(root, store)
    if packages is None:
        yield None
        return
    from coursebuild.effects.runner import ScriptServer

    with ScriptServer() as server:
        server.expect(packages)

        def run(*args: Any, **keywords: Any) -> tuple[ScriptRun, ...]:
            try:
                return server.run(*args, **keywords)
            finally:
                server.close()

        yield run


def likely_packages(root: Path, store: Store) -> tuple[str, ...] | None:
    """What the scripts that will run import; `None` where it seems that none will."""
    texts = [*_texts(root / "content/lessons"), *_texts(root / "content/pages")]
    if store.fresh or (store.shared is None and not _any(store.folder / "scripts")):
        found = [code for _, path in texts[:_MOST_READ] for _, code in _scripts(_read(path))]
    else:
        latest = heapq.nlargest(_LATEST, texts)
        found = [
            code
            for _, path in latest
            for example, code in _scripts(_read(path))
            if _read(f"{root}/{example}").rstrip(b"\n") != code.rstrip(b"\n")
        ]
    if not found:
        return None
    return said_packages(b"\n".join(found))


def _scripts(text: bytes) -> Iterator[tuple[str, bytes]]:
    """The scripts that run in a text: where they are extracted to, and their code."""
    text = text.replace(b"\r\n", b"\n")
    opened: re.Match[bytes] | None = None
    for fence in _FENCE.finditer(text if text.endswith(b"\n") else text + b"\n"):
        if opened is None:
            opened = fence
        elif fence[1].startswith(opened[1]) and not fence[2].strip():
            words = opened[2].split()
            path = _FILE.search(opened[2])
            if path is not None and words[0] == b"python" and b"norun" not in words:
                yield path[1].decode(), text[opened.end() : fence.start()]
            opened = None


def _texts(folder: Path) -> Iterator[tuple[int, str]]:
    """The texts of a folder, each after when it was saved."""
    with contextlib.suppress(OSError), os.scandir(folder) as entries:
        for entry in entries:
            if entry.name.endswith(".md") and entry.is_file():
                yield entry.stat().st_mtime_ns, entry.path


def _read(path: str) -> bytes:
    try:
        return Path(path).read_bytes() if Path(path).is_file() else b""  # a pipe has no end
    except OSError:
        return b""


def _any(folder: Path) -> bool:
    """Whether there is anything in a folder."""
    try:
        return next(folder.iterdir(), None) is not None
    except OSError:
        return False
