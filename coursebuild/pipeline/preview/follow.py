"""From events of the file system to saves, and from saves to pages.

Entry point: `follow(live, watcher, notice, said)`, which a thread of its own runs.

1. What one save of an editor comes to (an empty file that is written next, a new file that takes
   the place of the old one) counts once: when nothing more happened for some milliseconds. While
   that is awaited the page is made already, so that it costs no time.
2. Many files at once are a branch that is switched: there the wait is longer, but bounded.
3. A document that is gone or empty may be so only for a moment, and who has a file open may write
   more of it.
"""

from __future__ import annotations

import contextlib
import gc
import time
from collections.abc import Callable, Iterator

from coursebuild.effects.watch import Watcher
from coursebuild.pipeline.preview.live import MOST, LiveCourse
from coursebuild.render.library import owners

QUIET = 0.008
"""Seconds without an event after which a save is complete."""
QUIET_MANY = 0.060
"""The same where many files change."""
QUIET_GONE = 0.100
"""The same where a document is not there or empty."""
LONGEST = 0.250
"""Seconds after which what there is counts, whatever still happens; with many files, four times."""


def follow(
    live: LiveCourse,
    watcher: Watcher,
    notice: Callable[[], None],
    said: Callable[[frozenset[str], float], None],
) -> None:
    """Take saves until the watcher is stopped.

    `notice` is told that more than documents changed; `said` what was saved, and how many seconds
    after its first event it was taken.
    """
    while not watcher.stopped:
        watcher.watch_also(_elsewhere(live))
        paths = watcher.get(1.0)
        if paths:
            began = time.monotonic()
            live.calm.clear()
            try:
                taken = _take(live, watcher, paths, began, notice)
            finally:
                live.calm.set()
            if taken:
                said(paths, time.monotonic() - began)


def _take(
    live: LiveCourse,
    watcher: Watcher,
    paths: frozenset[str],
    began: float,
    notice: Callable[[], None],
) -> bool:
    """Take what a burst of events comes to; whether it came to anything."""
    while True:
        heard = time.monotonic()
        many = len(paths) > MOST
        last = began + LONGEST * (4 if many else 1)
        with live.changed, _without_collecting():
            plan = live.plan(paths)
            soon = plan is not None and plan.whole
            # So few milliseconds are waited for with the lock held: who asks for the page meanwhile
            # gets the new one.
            more = _more(watcher, heard + QUIET, last) if soon else frozenset()
            if plan is not None and soon and not more:
                live.commit(plan)
                return bool(plan.found)
        if not soon:
            more = _more(watcher, heard + (QUIET_MANY if many else QUIET_GONE), last)
            if not more:
                break
        paths |= more
    if plan is not None and live.commit(plan):
        return bool(plan.found)
    notice()
    return live.reread() or plan is None


def _more(watcher: Watcher, until: float, last: float) -> frozenset[str]:
    """What else happens until then; nothing where it has taken too long already."""
    now = time.monotonic()
    return watcher.get(max(min(until, last) - now, 0.0)) if now < last else frozenset()


@contextlib.contextmanager
def _without_collecting() -> Iterator[None]:
    """Leave looking for garbage to whoever has time for it: that takes up to some milliseconds."""
    on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if on:
            gc.enable()


def _elsewhere(live: LiveCourse) -> frozenset[str]:
    """The files of pages, wherever they lie."""
    course = live.course
    return frozenset() if course is None else frozenset(owner.path for owner in owners(course))
