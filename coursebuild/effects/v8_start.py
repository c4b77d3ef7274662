"""How V8 gets into a process.

Entry points: `preload`, for whoever makes copies of this process; `for_formulas_only`, for such a
copy; `start`.
"""

from __future__ import annotations

import contextlib
import ctypes
import importlib.util
from pathlib import Path

_FLAGS = ("--single-threaded", "--wasm-sync-tier-up", "--no-opt")
"""V8 has no threads here that would compile hot WebAssembly anew, and would stay with its first,
several times slower code; so it does that at once, where it is. Of the two compilers for hot
JavaScript the slower one is left out: typesetting a course would be over before it pays, and takes
a fifth less without; the code of labs runs as fast with the other."""
_SMALL = ("--max-semi-space-size=1",)
"""Room for new values, in MB: more does not make formulas faster."""
_MADV_DONTNEED = 4
"""Of Linux: what was read of a file is read again when it is looked at."""


_is_loaded = False


def preload() -> None:
    """Load V8's code, so that copies of this process share it; none of it runs before they do.

    To load it takes as long as to start it.
    """
    global _is_loaded
    found = importlib.util.find_spec("py_mini_racer") if not _is_loaded else None
    _is_loaded = True
    if found is not None and found.origin is not None:
        path = Path(found.origin).with_name("libmini_racer.so").resolve()
        with contextlib.suppress(OSError):
            ctypes.CDLL(str(path))
            _forget_names(path)


def _forget_names(library: Path) -> None:
    """Free the memory of what was only looked at to load a library: 18 MB of names."""
    try:
        advise = ctypes.CDLL(None).madvise
        maps = Path("/proc/self/maps").read_text(errors="replace").splitlines()
    except (OSError, AttributeError, TypeError):  # not on Linux
        return
    advise.argtypes = (ctypes.c_void_p, ctypes.c_size_t, ctypes.c_int)
    for line in maps:
        place, access, offset, _, _, *name = line.split(maxsplit=5)
        # The first part of a library is as in its file; in others addresses were put in.
        if name == [str(library)] and access == "r--p" and not int(offset, 16):
            start, end = (int(part, 16) for part in place.split("-"))
            advise(start, end - start, _MADV_DONTNEED)


def for_formulas_only() -> None:
    """V8, which has not started yet, will have what formulas need, and no tables of languages.

    It would read these into memory when it starts: 10 MB in each copy of this process. Without them
    `Intl` and what rests on it throw; properties and cases of characters are known all the same.
    """
    global _only_formulas
    _only_formulas = True


_only_formulas = False


def start() -> None:
    """Start V8, where it does not run yet."""
    from py_mini_racer import _dll, init_mini_racer

    preload()
    if _only_formulas:
        _dll._ICU_DATA_FILENAME = "__init__.py"  # a file that V8 finds no tables in
    flags = (*_FLAGS, *_SMALL) if _only_formulas else _FLAGS
    init_mini_racer(flags=flags, ignore_duplicate_init=True)
