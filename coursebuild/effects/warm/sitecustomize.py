"""The first code in a process of scripts: Python imports this file before it runs a script.

Entry point: Python's own start, with this folder first in PYTHONPATH.

The tool's folder is taken off the search path and out of the environment. Then the process either
becomes the fork server (see `forkserver`), of which copies come back from `serve` to become
scripts; or it is a script that was started on its own, and only what watches it is set up. That
this file ends with an ImportError is how `site` learns that there is no `sitecustomize`, so that
nothing of it stays behind.
"""

import os
import sys

_HERE = os.path.dirname(os.path.abspath(__file__))  # noqa: PTH100, PTH120 (pathlib is not loaded yet)


def _forget_folder() -> None:
    """Leave the search path and the environment as if this folder had not been there."""
    sys.path[:] = [entry for entry in sys.path if entry != _HERE]
    sys.path_importer_cache.pop(_HERE, None)
    rest = [e for e in os.environ["PYTHONPATH"].split(os.pathsep) if e != _HERE]
    if rest:
        os.environ["PYTHONPATH"] = os.pathsep.join(rest)
    else:
        del os.environ["PYTHONPATH"]


def _import_real_one() -> bool:
    """Import the installation's own `sitecustomize`, if it has one, as `site` would have."""
    own = sys.modules.pop(__name__)
    try:
        import sitecustomize  # type: ignore[import-not-found]  # noqa: F401
    except ImportError as error:
        if error.name != "sitecustomize":
            raise
        sys.modules[__name__] = own
        return False
    return True


def _start() -> None:
    bare = frozenset(sys.modules) - {__name__}
    root = os.path.dirname(os.path.dirname(os.path.dirname(_HERE)))  # noqa: PTH120
    sys.path.insert(0, root)
    trace = os.environ.pop("COURSEBUILD_TRACE", None)
    if trace is not None:
        from coursebuild.effects import spawned

        spawned.start(trace, root, bare)
        return
    from coursebuild.effects import preload

    recorder = preload.Recorder(bare)
    with recorder:
        from coursebuild.effects import forkserver
    sys.path.remove(root)
    forkserver.serve(recorder, int(sys.argv[1]))


_forget_folder()
if not _import_real_one():
    _start()
    raise ImportError("there is none", name="sitecustomize")
_start()
