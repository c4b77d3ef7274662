"""How often terms occur in a text.

Entry points: `runs(text)` with `TERMS`, and `counted(text)`, which is both.

1. The text is cut where no token reaches over: at white space and at the signs of ASCII that are
   part of none. What is between is a run, such as `body's`, `2.5e-3` or `data.qpos`.
2. Runs are counted before anything is known of them.
3. A course repeats its words from page to page: the terms of each different run are found once.
"""

from __future__ import annotations

from collections import Counter

from coursebuild.render.search.words import LONGEST, terms_of

_MOST = 1 << 14
"""Runs that are remembered."""
_INNER = b"_.+-'"
"""What may stand in a token, or decides where one ends, beside letters and digits."""
_CUT = bytes(
    code if code > 0x7F or bytes((code,)).isalnum() or code in _INNER else 0x20
    for code in range(256)
)
"""Makes blanks of the other signs; what is not ASCII has no byte below 128."""


def runs(text: str) -> Counter[bytes]:
    """The runs of a text in UTF-8, and how often each occurs."""
    return Counter(text.encode("utf-8", "surrogatepass").translate(_CUT).split())


class _Terms(dict[bytes, tuple[str, ...]]):
    """The terms of runs, in order and with repeats."""

    def __missing__(self, run: bytes) -> tuple[str, ...]:
        if run.isalpha() and run.islower() and len(run) <= LONGEST:  # ASCII, as most are
            found: tuple[str, ...] = (run.decode(),)
        else:
            found = tuple(terms_of(run.decode("utf-8", "surrogatepass")))
        if len(self) >= _MOST:
            self.clear()
        self[run] = found
        return found


TERMS = _Terms()
"""The terms of every run; those that were asked for are remembered."""


def counted(text: str) -> dict[str, int]:
    """How often each term occurs."""
    found: dict[str, int] = {}
    for run, times in runs(text).items():
        for term in TERMS[run]:
            found[term] = found.get(term, 0) + times
    return found
