"""Results that are expensive to make and depend on nothing but their key, kept in `.coursebuild/`.

Entry points: `kept(root, kind, key, make)`; `load` and `keep`, its two halves.

An entry begins with the hash of what follows, so that one which was cut or flipped is made again
instead of served. Nothing is lost when the folder is deleted.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import tempfile
from collections.abc import Callable
from pathlib import Path

from coursebuild.effects.locks import make_private_folder

_DIGEST = hashlib.sha256().digest_size


def kept(root: Path, kind: str, key: str, make: Callable[[], bytes]) -> bytes:
    """The result of this kind and key: from the store, or made now and kept."""
    found = load(root, kind, key)
    if found is None:
        found = make()
        keep(root, kind, key, found)
    return found


def load(root: Path, kind: str, key: str) -> bytes | None:
    """The result of this kind and key, if it is in the store and whole."""
    with contextlib.suppress(OSError):
        data = (root / ".coursebuild" / kind / key).read_bytes()
        if data[:_DIGEST] == hashlib.sha256(data[_DIGEST:]).digest():
            return data[_DIGEST:]
    return None


def keep(root: Path, kind: str, key: str, data: bytes) -> None:
    """Put a result into the store; one that cannot be written only costs time."""
    with contextlib.suppress(OSError):
        make_private_folder(root / ".coursebuild")
        path = root / ".coursebuild" / kind / key
        path.parent.mkdir(exist_ok=True)
        _write(path, hashlib.sha256(data).digest() + data)


def _write(path: Path, data: bytes) -> None:
    """Whole or not at all: readers in other processes see the old entry or the new one."""
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=".new-")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
        Path(name).replace(path)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise
