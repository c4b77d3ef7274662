"""How V8 gets into a process.

Entry points: `preload`, for whoever makes copies of this process; `for_formulas_only`, for such a
copy; `start`; `runs`.
"""

from __future__ import annotations

import contextlib
import ctypes
import functools
import threading
from pathlib import Path

from coursebuild.effects.errors import EffectError
from coursebuild.effects.v8_library import library, library_path

_FLAGS = (
    "--single-threaded",
    "--wasm-sync-tier-up",
    "--no-opt",
    "--invocation-count-for-maglev=2000",
)
"""V8 has no threads here that would compile hot WebAssembly anew, and would stay with its first,
several times slower code; so it does that at once, where it is. Of the two compilers for hot
JavaScript the slower one is left out: typesetting a course would be over before it pays, and takes
a fifth less without; the code of labs runs as fast with the other. That one compiles a function
after 2,000 calls: as early as V8 does by itself, it took a quarter of the time of typesetting."""
_SMALL = ("--max-semi-space-size=1",)
"""Room for new values, in MB: more does not make formulas faster."""
_LANGUAGES = "icudtl.dat"
"""Tables of languages: a file beside the library."""
_MADV_DONTNEED = 4
"""Of Linux: what was read of a file is read again when it is looked at."""

_lock = threading.Lock()
_only_formulas = False
_runs = False


def preload() -> None:
    """Load V8's code, so that copies of this process share it; none of it runs before they do.

    To load it takes as long as to start it. Where it cannot be loaded, `start` tells.
    """
    with contextlib.suppress(EffectError):
        _load()


@functools.cache
def _load() -> None:
    library()
    _forget_names(library_path().resolve())


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


def start() -> None:
    """Start V8, where it does not run yet.

    Raises:
        EffectError: it is not there.
    """
    global _runs
    with _lock:
        if _runs:
            return
        _load()
        # It starts without tables where there is no such file.
        tables = library_path().with_name("none" if _only_formulas else _LANGUAGES)
        if not _only_formulas and not tables.exists():
            raise EffectError(f"V8 lacks {tables}", help="run `pip install coursebuild` again")
        flags = (*_FLAGS, *_SMALL) if _only_formulas else _FLAGS
        library().mr_init_v8(" ".join(flags).encode(), str(tables).encode())
        _runs = True


def runs() -> bool:
    """Whether V8 was started in this process: its threads do not come along into a copy."""
    return _runs
