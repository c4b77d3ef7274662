"""The first code in a process of scripts: Python imports this file before it runs a script.

Entry point: Python's own start, with this folder first in PYTHONPATH.

The tool's folder is taken off the search path and out of the environment. Then the process either
becomes the fork server (see `forkserver`), of which copies come back from `serve` to become
scripts; or it is a script that was started on its own, and only what watches it is set up. Mostly
this file ends with the ImportError by which `site` learns that there is no `sitecustomize`, so that
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


def _import_real_one() -> Exception | None:
    """Import the installation's own `sitecustomize`; what that raises is what `site` is to see."""
    own = sys.modules.pop(__name__)
    try:
        import sitecustomize  # type: ignore[import-not-found]  # noqa: F401
    except Exception as error:
        sys.modules[__name__] = own
        return error
    return None


def _catch_output() -> int:
    """Let what is printed from now on go to a file without a name; a script's pipes replace it."""
    said = os.memfd_create("said")
    os.dup2(said, 1)
    os.dup2(said, 2)
    return said


def _start(bare: frozenset[str]) -> None:
    root = os.path.dirname(os.path.dirname(os.path.dirname(os.path.dirname(_HERE))))  # noqa: PTH120
    sys.path.insert(0, root)
    if _TRACE is not None:
        from coursebuild.core.run import spawned

        spawned.start(_TRACE, root, bare, int(_PERTURBATION))
        return
    from coursebuild.core.run import preload

    recorder = preload.Recorder(bare)
    with recorder:
        from coursebuild.core.run import forkserver
    sys.path.remove(root)
    forkserver.serve(recorder, int(sys.argv[1]), _SAID)


_forget_folder()
_TRACE = os.environ.pop("COURSEBUILD_TRACE", None)
_PERTURBATION = os.environ.pop("COURSEBUILD_PERTURBATION", "0")
_SAID = _catch_output() if _TRACE is None else -1
_error = _import_real_one()
_start(frozenset(sys.modules) - ({__name__} if _error else set()))
if _error:
    raise _error
