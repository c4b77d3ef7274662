"""The program that runs what readers are handed over as it would run for one of them.

It reads a JSON object from its input: files by path in Base64, the path of the one to run, its
arguments, the figures that it draws, the top-level modules of other packages that it declares, how
many MiB it may take, and a mark to print before what the C library has kept back until the end. The
files are put into a new folder, which holds nothing else.

There is no network. The files may import what they declare, each other and what Python brings; what
a package imports for itself is its own matter.
"""

import base64
import contextlib
import json
import os
import sys
import tempfile
from importlib.abc import MetaPathFinder
from pathlib import Path
from types import ModuleType
from typing import Any

_NETWORK = ("socket.connect", "socket.getaddrinfo", "socket.gethostbyname", "socket.sendto")


class _Declared(MetaPathFinder):
    """Refuses modules that the files import without declaring them."""

    def __init__(self, folder: str, modules: "frozenset[str]") -> None:
        self._prefix, self._modules = folder + os.sep, modules | sys.stdlib_module_names

    def find_spec(self, name: str, path: Any, target: Any = None) -> None:
        top = name.partition(".")[0]
        frame = sys._getframe(1)
        while frame.f_back is not None and "importlib" in frame.f_code.co_filename:
            frame = frame.f_back
        if frame.f_code.co_filename.startswith(self._prefix) and top not in self._modules:
            raise ModuleNotFoundError(f"{top!r} is imported but not declared", name=top)


def _refuse_network(event: str, arguments: Any) -> None:
    if event in _NETWORK and (event != "socket.connect" or isinstance(arguments[1], tuple)):
        raise PermissionError("there is no network here")


def _run(job: Any) -> None:
    folder = os.path.realpath(tempfile.mkdtemp(dir=Path.cwd()))
    os.chdir(folder)
    for path, data in job["files"].items():
        Path(path).parent.mkdir(parents=True, exist_ok=True)
        Path(path).write_bytes(base64.b64decode(data))
    with contextlib.suppress(ImportError, AttributeError, ValueError, OSError):
        import resource

        resource.setrlimit(resource.RLIMIT_DATA, (job["memory"] << 20,) * 2)
    path = os.path.join(folder, job["path"])  # noqa: PTH118
    neighbours = {entry.stem for entry in Path(path).parent.iterdir()}
    sys.meta_path.insert(0, _Declared(folder, frozenset(job["modules"]) | neighbours))
    sys.addaudithook(_refuse_network)
    sys.argv = [job["path"], *job["arguments"]]
    sys.path.insert(0, os.path.dirname(path))  # noqa: PTH120
    script = sys.modules["__main__"] = ModuleType("__main__")
    script.__file__ = path
    output = os.dup(1)
    exec(compile(Path(path).read_bytes(), path, "exec", dont_inherit=True), script.__dict__)
    with contextlib.suppress(AttributeError, OSError, ValueError):  # a script's own, or closed
        sys.stdout.flush()
    os.write(output, job["mark"].encode())
    undrawn = [name for name in job["figures"] if not Path(folder, name).is_file()]
    if undrawn:
        sys.exit(f"it has not drawn {', '.join(undrawn)}")


if __name__ == "__main__":
    _run(json.load(sys.stdin))
