"""Swapping two folders in one step, where the system can.

Entry point: `exchange(a, b)`. Linux: renameat2 with RENAME_EXCHANGE; macOS: renamex_np with
RENAME_SWAP. Elsewhere, and on file systems that cannot, it says so, and the caller has to rename
twice.
"""

from __future__ import annotations

import ctypes
import errno
import functools
import os
import sys
from collections.abc import Callable
from pathlib import Path

_AT_FDCWD = -100
_RENAME_EXCHANGE = 2  # linux/fs.h
_RENAME_SWAP = 2  # sys/stdio.h of macOS
_UNSUPPORTED = frozenset({errno.ENOSYS, errno.EINVAL, errno.ENOTSUP, errno.EOPNOTSUPP, errno.EPERM})


def exchange(a: Path, b: Path) -> bool:
    """Swap what stands at two paths, in one step.

    Returns:
        Whether it was done; `False` where the system or the file system has no such operation.

    Raises:
        OSError: it has one, and refused.
    """
    function = _native()
    if function is None:
        return False
    code = function(os.fsencode(a), os.fsencode(b))
    if code == 0:
        return True
    if code in _UNSUPPORTED:
        return False
    raise OSError(code, os.strerror(code), str(a), None, str(b))


@functools.cache
def _native() -> Callable[[bytes, bytes], int] | None:
    """The system's own function, as one from two paths to an errno (0: done)."""
    if sys.platform == "linux":
        name, arguments = "renameat2", (ctypes.c_int, ctypes.c_char_p) * 2 + (ctypes.c_uint,)
    elif sys.platform == "darwin":
        name, arguments = "renamex_np", (ctypes.c_char_p, ctypes.c_char_p, ctypes.c_uint)
    else:
        return None
    try:
        native = getattr(ctypes.CDLL(None, use_errno=True), name)
    except (OSError, AttributeError):
        return None
    native.argtypes = arguments
    native.restype = ctypes.c_int

    def call(a: bytes, b: bytes) -> int:
        if name == "renameat2":
            status = native(_AT_FDCWD, a, _AT_FDCWD, b, _RENAME_EXCHANGE)
        else:
            status = native(a, b, _RENAME_SWAP)
        return 0 if status == 0 else ctypes.get_errno()

    return call
