"""What every command has: the course and its store, the lessons named, and words on its progress.

Messages about long work, while it runs, are a live line on a terminal, plain lines elsewhere, which
show in a log where the time goes and what hangs. They go to standard error, so that standard output
holds only results.
"""

from __future__ import annotations

import os
import re
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TextIO

from msgspec import Struct, field
from msgspec.structs import replace

from coursebuild.core.engine.shared_place import shared_place
from coursebuild.core.engine.store import SIZE, Store
from coursebuild.core.features import Executor
from coursebuild.core.files.errors import EffectError
from coursebuild.core.files.errors import UsageError as UsageError
from coursebuild.core.files.read import find_root
from coursebuild.core.files.trust import FOLDER, FOREIGN
from coursebuild.core.files.write import undo_changes
from coursebuild.core.model import Course, Lesson, Owner
from coursebuild.core.model.results import ScriptRun
from coursebuild.core.run.run_store import RunStore
from coursebuild.core.run.sandbox import Sandbox
from coursebuild.core.run.script_environment import Interpreter, course_environment
from coursebuild.core.run.script_server import RunAll
from coursebuild.core.text.characters import printable, printable_lines
from coursebuild.core.text.diagnostics import did_you_mean
from coursebuild.core.text.near import nearest
from coursebuild.output import discard
from coursebuild.report.text import clip

_INTERVAL = 0.1
"""Seconds between updates of the live line."""
_LONG = 1.0
"""Seconds from which on it is worth saying how long a script took the last time."""
_ERASE = "\r\x1b[K"


class Progress:
    """Says which stage runs, which scripts run, and how long they take.

    Safe to call from several threads.
    """

    def __init__(self, stream: TextIO | None = None, *, quiet: bool = False) -> None:
        self.stream = sys.stderr if stream is None else stream
        self.quiet = quiet
        # The tool may have been started without a standard error.
        self._has_readers = not quiet and self.stream is not None
        self.live = self._has_readers and self.stream.isatty() and os.environ.get("TERM") != "dumb"
        self._lock = threading.Lock()
        self._running_since: dict[str, float] = {}
        self._last_seconds: dict[str, float | None] = {}
        self._activities: dict[str, str] = {}
        self._stage = ""
        self._last_line = ""
        self._since = 0.0
        self._ended_count = 0
        self._total = 0
        self._stop = threading.Event()

    @contextmanager
    def stage(self, name: str, total: int = 0) -> Iterator[None]:
        """Show a stage of the work, in which `total` scripts run."""
        self._stage, self._ended_count, self._total, self._since = name, 0, total, time.monotonic()
        if not self.live:
            line = f"{name} ({total})" if total else name
            if line != self._last_line:  # else it is the next part of the same work
                self.say(line)
            self._last_line = line
            yield
            return
        self._stop.clear()
        ticker = threading.Thread(target=self._tick, name="progress", daemon=True)
        ticker.start()
        try:
            yield
        finally:
            while ticker.is_alive():  # it writes below nothing that is said after this
                with suppress(KeyboardInterrupt):  # a further Ctrl-C; one has ended the stage
                    self._stop.set()
                    ticker.join()
            with self._lock:
                self._write(_ERASE)
                self._running_since.clear()

    def start(self, name: str, last_seconds: float | None = None) -> None:
        """Show that a script runs; `last_seconds` is how long it took the last time."""
        with self._lock:
            self._running_since[name] = time.monotonic()
            self._last_seconds[name] = last_seconds
            if not self.live:
                is_long = last_seconds is not None and last_seconds >= _LONG
                time_text = f" ({last_seconds:.0f} s the last time)" if is_long else ""
                self._write(f"  {printable(name)}{time_text}\n")

    def describe(self, name: str, activity: str) -> None:
        """Show what something that runs is doing; only on a terminal."""
        with self._lock:
            self._activities[name] = activity

    def skip(self) -> None:
        """Count something that need not run, since its result is stored."""
        with self._lock:
            self._ended_count += 1

    def finish(self, name: str, verdict: str, seconds: float) -> None:
        """Show that a script ended; the verdict is one word, such as `ok` or `timeout`."""
        with self._lock:
            self._running_since.pop(name, None)
            self._activities.pop(name, None)
            self._ended_count += 1
            if not self.live:
                self._write(f"  {printable(name)}: {verdict} after {seconds:.2f} s\n")

    def say(self, text: str) -> None:
        """Print a line, unless quiet."""
        with self._lock:
            self._write(f"{_ERASE if self.live else ''}{printable_lines(text)}\n")

    def _tick(self) -> None:
        while True:
            with self._lock:
                try:
                    columns = os.get_terminal_size(self.stream.fileno()).columns or 80
                except (OSError, ValueError):
                    columns = 80
                self._write(_ERASE + clip(self._line(time.monotonic()), columns - 1))
            if self._stop.wait(_INTERVAL):
                return

    def _line(self, now: float) -> str:
        if not self._total:
            return f"{self._stage}  {now - self._since:.0f} s"
        activities = {name: f" ({activity})" for name, activity in self._activities.items()}

        def times(name: str, seconds: float) -> str:
            last = self._last_seconds.get(name)
            if last is None or last < _LONG:
                return f"{seconds:.0f} s"
            left = f"{last - seconds:.0f} s left, " if seconds < last else ""
            return f"{seconds:.0f} s ({left}{last:.0f} s the last time)"

        names = [
            f"{printable(name)}{activities.get(name, '')} {times(name, now - since)}"
            for name, since in self._running_since.items()
        ]
        return f"{self._stage} {self._ended_count}/{self._total}  {', '.join(names)}"

    def _write(self, text: str) -> None:
        if not self._has_readers:
            return
        try:
            self.stream.write(text)
            self.stream.flush()
        except ValueError:  # it was closed
            self._has_readers = False
        except OSError:  # nobody reads any more; the work goes on
            self._has_readers = False
            discard(self.stream.fileno())


class Options(Struct, frozen=True):
    """Where the course is and how to work on it."""

    root: Path
    """Absolute, links resolved."""
    jobs: int
    """How many scripts run at a time."""
    store: Store
    """Results made before."""
    progress: Progress = field(default_factory=lambda: Progress(quiet=True))
    """Says what is done; by default nothing."""
    long: bool = False
    """Whether scripts run that have a recorded run in the course."""
    verbose: bool = False
    """Whether to say why each script runs."""
    run_all: RunAll | None = None
    """Runs scripts, where a `ScriptServer` stays warm from run to run."""
    executor: Executor | None = None
    """Other processes that do the work of this one; `run_all` is theirs then."""
    on_start: Callable[[str, float | None], object] | None = None
    """Takes the path of each script that begins, and the seconds that it took the last time."""
    on_result: Callable[[ScriptRun], object] | None = None
    """Takes the result of each script that runs, while others run."""
    interpreter: Interpreter | None = None
    """The interpreter of scripts, if it is another than ours; see `for_course`."""
    strict: bool = False
    """Whether warnings count as errors, whatever the map says."""
    sandbox: Sandbox | None = None
    """The sandbox of each script; with one, no other code of the course runs."""

    def for_course(self, course: Course) -> Options:
        """The same options, with the environment that the map names for scripts, if it works."""
        return replace(self, interpreter=course_environment(self.root, course).value)

    def run_store(self, *, fresh: bool = False) -> RunStore:
        """The remembered results of scripts; `fresh`: all scripts are to run again."""
        return RunStore(self.root, self.store, fresh=fresh, interpreter=self.interpreter)


def find_course(directory: str | None) -> Path:
    """Find the course's folder: the one named, or the nearest above with `content/course.toml`.

    A named folder without a map is taken all the same: the missing map is then a mistake of the
    course. What a killed command left half changed is undone.
    """
    try:
        start = Path.cwd()
    except OSError:
        raise UsageError("the working directory no longer exists") from None
    root = find_root(None if directory is None else Path(directory), start)
    check_path(root)
    undo_changes(root, Progress().say)
    return root


def check_path(root: Path) -> None:
    """Refuse a folder that no course can lie in.

    MuJoCo opens no file whose path is not UTF-8, and a script cannot print it; of a path with a
    backslash MuJoCo takes that for a slash.
    """
    path = os.fsencode(root)
    text = path.decode("utf-8", "backslashreplace")
    if text.encode() != path:
        raise UsageError(f"the path of the course is not UTF-8: {text}")
    if "\\" in text:
        raise UsageError(f"the path of the course has a backslash, which MuJoCo misreads: {text}")


def open_store(root: Path, location: str | None, size: str | None, *, fresh: bool = False) -> Store:
    """Open the store of results: here, and at a shared place.

    What the command line does not set (`None`), the environment may: `COURSEBUILD_CACHE` the place,
    `COURSEBUILD_CACHE_SIZE` the size of the store here. `COURSEBUILD_CACHE_KEY` signs the entries
    at the shared place: a secret, which must not stand on a command line.

    Raises:
        UsageError: the place or the size is not valid.
    """
    option = "--cache-size"
    if size is None:
        option, size = "COURSEBUILD_CACHE_SIZE", os.environ.get("COURSEBUILD_CACHE_SIZE") or None
    limit = SIZE
    if size is not None:
        match = re.fullmatch(r"([0-9]{1,15})([KMGT]?)", size, re.IGNORECASE)
        if match is None:
            message = f"{option}: {size!r} is not a size: a whole number, perhaps with K, M, G or T"
            raise UsageError(message)
        limit = int(match[1]) << (10 * " KMGT".index(match[2].upper() or " "))
    if location is None:
        location = os.environ.get("COURSEBUILD_CACHE") or None
    elif not location:
        raise UsageError("--cache needs a place")
    shared = None
    if location is not None:
        try:
            key = os.environ.get("COURSEBUILD_CACHE_KEY", "").encode("utf-8", "surrogateescape")
            shared = shared_place(location, key)
        except EffectError as error:
            raise UsageError(error.message, help=error.help) from None
    store = Store(root, shared=shared, size=limit, fresh=fresh)
    if store.set_aside not in ("", FOREIGN):
        Progress().say(f"warning: {FOLDER} {store.set_aside}; it is set aside")
    return store


def select(course: Course, names: tuple[str, ...], root: Path) -> frozenset[str] | None:
    """Find the lessons named by id, slug, `id-slug` or file, and the pages named by id or file.

    Return the paths of their files; `None`, for everything, where there are no names. A file may be
    given from the course's folder or from the working directory.

    Raises:
        UsageError: a name means nothing, or a lesson that is not written yet.
    """
    return frozenset(find_owner(course, name, root).path for name in names) if names else None


def documents_by_name(course: Course) -> dict[str, Owner]:
    """Lessons by id, slug, `id-slug` and file, pages by id and file."""
    owners: dict[str, Owner] = {}
    for page in course.pages:
        owners |= {page.id: page, page.path: page}
    for lesson in course.lessons:
        file = f"{lesson.id}-{lesson.slug}"
        for alias in (lesson.slug, file, f"{file}.md", lesson.path, lesson.id):
            owners[alias] = lesson
    return owners


def path_from_root(name: str, root: Path) -> str:
    """The path in the course of a file named from its folder or from the working directory."""
    for start in (root, Path.cwd()):
        path = Path(os.path.normpath(start / name))
        if path.exists() and path.is_relative_to(root):
            return path.relative_to(root).as_posix()
    return name


def find_owner(course: Course, name: str, root: Path) -> Owner:
    """The lesson or page of a name.

    Raises:
        UsageError: there is none, or nothing is written of it yet.
    """
    by_name = documents_by_name(course)
    owner = by_name.get(name) or by_name.get(path_from_root(name, root))
    if owner is None:
        closest = nearest(name, [alias for alias in by_name if ("/" in alias) == ("/" in name)])
        lesson_ids = [lesson.id for lesson in course.lessons if lesson.status != "planned"]
        alternatives = did_you_mean("", [*lesson_ids, *(page.id for page in course.pages)])
        help = f"did you mean `{closest}`?" if closest is not None else alternatives
        raise UsageError(f"no lesson or page is called `{name}`", help=help)
    if isinstance(owner, Lesson) and owner.status == "planned":
        raise UsageError(f"lesson {owner.id} is planned, so there is nothing in it yet")
    return owner
