"""`coursebuild serve`: the course as a site in memory that follows every save.

Entry point: `serve(options, port)`.

1. The course is read; its pages are drawn when they are asked for.
2. A thread takes saves (`preview.follow`): the page that was saved is new within milliseconds.
3. The main thread does the rest behind it (`preview.behind`): scripts, labs, fonts, whole checks.

The last good page stays while something is wrong; what is wrong is printed and shown over it.
"""

from __future__ import annotations

import functools
import gc
import sys
import threading

from coursebuild.effects.errors import EffectError
from coursebuild.effects.exit_immediately import exit_immediately
from coursebuild.effects.packages import distributions, library_files
from coursebuild.effects.prepared import prepared_folder
from coursebuild.effects.read import read_bytes
from coursebuild.effects.resources import bundled_files, template_texts
from coursebuild.effects.server import PreviewServer
from coursebuild.effects.watch import Watcher
from coursebuild.model import Course
from coursebuild.pipeline.documents import Documents
from coursebuild.pipeline.kept import kept_font
from coursebuild.pipeline.options import Options, UsageError
from coursebuild.pipeline.preview.behind import Behind
from coursebuild.pipeline.preview.follow import follow
from coursebuild.pipeline.preview.live import LiveCourse
from coursebuild.pipeline.preview.noted import Noted
from coursebuild.pipeline.preview.told import accept, page_news
from coursebuild.pipeline.progress import Progress
from coursebuild.render.assets import Assets, page_script
from coursebuild.render.zips import Package, Surroundings, imported_modules
from coursebuild.results import OutputFile

_GARBAGE = 200_000
"""Objects after which those in cycles are looked for: a preview lives long."""
_SWITCH = 0.001
"""Seconds after which a thread that computes lets another one: a save should not wait for long."""


class Site:
    """A live course as the server sees it."""

    def __init__(self, live: LiveCourse) -> None:
        self._live = live
        self.changed = live.changed

    @property
    def version(self) -> int:
        """See `LiveCourse`."""
        return self._live.version

    def find(self, path: str) -> bytes | None:
        """A file of the site."""
        return self._live.find(path)

    def base(self) -> str:
        """The path of the course's base address."""
        return self._live.pages.base()

    def expected(self, path: str) -> bool:
        """Whether a page has mistakes and was never good."""
        return self._live.pages.has_page(path)

    def news(self, path: str) -> str:
        """What a page is told."""
        return page_news(self._live, path)

    def accept(self, path: str, id: str) -> str:
        """Write what a page offers."""
        return accept(self._live, path, id)


def serve(options: Options, port: int) -> None:
    """Serve until interrupted, which is how a preview ends, and this process with it."""
    progress = Progress(quiet=options.quiet)
    live = live_course(options)
    bundled = dict(bundled_files())
    files = {
        "preview.js": page_script(bundled["js/preview.js"]),
        "preview.css": bundled["css/preview.css"],
        "worker.js": page_script(bundled["js/preview-worker.js"]),
    }
    try:
        server = PreviewServer(port, Site(live), files)
    except OSError as error:
        raise UsageError(f"port {port} cannot be used: {error.strerror or error}") from None
    saves = Watcher(options.root)
    before = sys.getswitchinterval()
    sys.setswitchinterval(_SWITCH)
    try:
        print(f"serving {server.url} (stop with Ctrl-C)", file=sys.stderr, flush=True)
        _first_reading(live, options, progress)
        gc.freeze()  # what is read lives as long as the preview: nobody need look through it again
        gc.set_threshold(_GARBAGE, 50, 50)
        server.start()
        saves.start()
        _work(live, saves, options, progress, server.url)
    except KeyboardInterrupt:
        progress.say("stopped")
    finally:
        saves.stop()
        server.stop()
        live.close()
        options.store.close()
        sys.setswitchinterval(before)
    exit_immediately(0)


def live_course(options: Options) -> LiveCourse:
    """The course of these options, not read yet."""
    assets = Assets(template_texts(), bundled_files(), prepared_folder())
    fonts = functools.partial(kept_font, options.store)
    around = functools.partial(_surroundings, options)
    # Later readings are few, and no copies are made of a process with threads.
    documents, noted = Documents(options.store, 1), Noted(options.store)
    return LiveCourse(options.root, assets, fonts, around, documents, noted)


def _first_reading(live: LiveCourse, options: Options, progress: Progress) -> None:
    """Read the course on all cores, while this process has no threads."""
    later = live.documents
    with Documents(options.store, options.jobs, progress.stage) as live.documents:
        live.reread()
    live.documents = later


def _work(live: LiveCourse, saves: Watcher, options: Options, progress: Progress, url: str) -> None:
    """Follow a course that was read; ends by an exception only."""
    progress.say(f"ready: {url}")
    behind = Behind(live, options, progress)
    saves.wait()

    def saved(paths: frozenset[str], seconds: float) -> None:
        names = ", ".join(sorted(paths)[:3]) + (" …" if len(paths) > 3 else "")
        progress.say(f"changed: {names} ({1e3 * seconds:.0f} ms)")

    def run() -> None:
        try:
            follow(live, saves, behind.notice, saved)
        except BaseException as error:  # told by the main thread
            behind.fail(error)

    threading.Thread(target=run, name="saves", daemon=True).start()
    try:
        behind.follow()
    finally:
        behind.close()


def _surroundings(options: Options, course: Course) -> Surroundings:
    """What the archives of scripts need."""
    library = library_files()
    packages = tuple(
        Package(*p) for p in distributions(options.store, imported_modules(course, library))
    )
    meshes: list[OutputFile] = []
    for path in course.files:
        if path.startswith("models/"):
            try:
                meshes.append(OutputFile(path, read_bytes(options.root, path)))
            except EffectError:
                continue  # gone since the course was read
    return Surroundings(packages, library, tuple(meshes))
