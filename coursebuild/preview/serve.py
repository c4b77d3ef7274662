"""`coursebuild serve`: the course as a site in memory that follows every save.

Entry point: `serve`.

1. The course is read; its pages are drawn when they are asked for.
2. A thread takes saves (`saves`): the page that was saved is new within milliseconds.
3. The main thread does the rest behind it (`rebuild`): scripts, labs, fonts, whole checks.

The last good page stays while something is wrong; what is wrong is printed and shown over it.
"""

from __future__ import annotations

import sys
import threading
import webbrowser
from typing import NoReturn

import segno

from coursebuild.pipeline.options import Options, UsageError
from coursebuild.pipeline.progress import Progress
from coursebuild.preview.rebuild import BackgroundRebuild
from coursebuild.preview.saves import follow
from coursebuild.preview.server import PreviewServer
from coursebuild.preview.session import Session
from coursebuild.preview.watcher import FolderWatcher
from coursebuild.report import Style


def serve(
    options: Options,
    host: str,
    port: int,
    embed: tuple[str, ...],
    style: Style,
    *,
    browse: bool,
) -> NoReturn:
    """Serve until interrupted.

    `embed`: origins whose pages may show the preview in a frame. `style`: of what is printed.
    `browse`: open a browser.
    """
    progress = Progress(quiet=options.quiet)
    session = Session(options)
    try:
        server = PreviewServer(host, port, session, embed)
    except OSError as error:
        why = error.strerror or error
        raise UsageError(f"port {port} of {host} cannot be used: {why}") from None
    watcher = FolderWatcher(options.root)
    rebuild = BackgroundRebuild(session, progress, style)

    def take_saves() -> None:
        try:
            follow(session, watcher, progress)
        except BaseException as error:  # told by the main thread
            rebuild.fail(error)

    try:
        session.start(progress)
        server.start()
        watcher.start()
        _announce(server.links, browse=browse, draw=progress.live)
        threading.Thread(target=take_saves, name="saves", daemon=True).start()
        rebuild.follow()
    finally:
        watcher.stop()
        server.stop()
        rebuild.close()
        session.close()
        options.store.close()


def _announce(links: list[str], *, browse: bool, draw: bool) -> None:
    """Say where the preview is, which answers there by now; for a phone's camera it is drawn."""
    first, *others = links
    print(f"serving {first} (stop with Ctrl-C)", file=sys.stderr, flush=True)
    for link in others:
        print(f"     or {link}", file=sys.stderr, flush=True)
    if draw and "?" in links[-1]:
        segno.make(links[-1]).terminal(sys.stderr, compact=True)
    if browse:  # some wait until their window is there
        threading.Thread(target=webbrowser.open, args=(first,), name="open", daemon=True).start()
