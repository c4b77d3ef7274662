"""`coursebuild serve`: build, serve from memory, build again and reload the page after each save.

Entry point: `serve(options, port)`. The last good site stays while something is wrong; what is
wrong is printed and shown over the page.
"""

from __future__ import annotations

import sys
import threading
from dataclasses import replace

from coursebuild.effects.errors import EffectError
from coursebuild.effects.locks import project_lock
from coursebuild.effects.resources import bundled_files
from coursebuild.effects.server import PreviewServer
from coursebuild.effects.watch import changes
from coursebuild.pipeline.build import prepare
from coursebuild.pipeline.options import Options, UsageError
from coursebuild.pipeline.progress import Progress
from coursebuild.report import Style, render_report


def serve(options: Options, port: int) -> None:
    """Serve until interrupted, which is how a preview ends."""
    progress = Progress(quiet=options.quiet)
    script = dict(bundled_files())["js/preview.js"]
    try:
        server = PreviewServer(port, script)
    except OSError as error:
        raise UsageError(f"port {port} cannot be used: {error.strerror or error}") from None
    server.start()
    print(f"serving {server.url} (stop with Ctrl-C)", file=sys.stderr, flush=True)
    stop = threading.Event()
    try:
        # Watched from before the first build on, so that no save is missed.
        for changed in changes(options.root, stop):
            if changed:
                names = sorted(changed)
                progress.say(f"changed: {', '.join(names[:3])}{' …' if len(names) > 3 else ''}")
            _rebuild(options, progress, server)
    except KeyboardInterrupt:
        progress.say("stopped")
    finally:
        stop.set()
        server.stop()


def _rebuild(options: Options, progress: Progress, server: PreviewServer) -> None:
    """Build once; a course that cannot be read right now is told like any other mistake."""
    try:
        with project_lock(options.root, progress.say):
            prepared = prepare(options, progress)
    except EffectError as error:
        text = f"coursebuild: {error.message}" + (f"\n{error.help}" if error.help else "")
        print(text, file=sys.stderr, flush=True)
        server.problems(text)
        return
    report = prepared.report
    if report.ok:
        server.publish(prepared.files)
        progress.say(f"ready: {server.url}")
    else:
        text = render_report(replace(report, scripts=()), "text", Style())
        print(text, file=sys.stderr, flush=True)
        server.problems(text)
