"""What watches a script that has an interpreter of its own.

Entry point: `start`, called by `warm/sitecustomize` while that Python starts. Nothing that is not
in every Python from its start may stay in `sys.modules`.
"""

from __future__ import annotations

import posix
import sys

from coursebuild.core.run import (
    initial_state_perturbation,
    mujoco_tracing,
    mujoco_watching,
    tracing,
)

TYPE_CHECKING = False
if TYPE_CHECKING:
    from importlib.machinery import ModuleSpec
    from types import ModuleType
    from typing import Any


def start(notes: str, tool: str, bare: frozenset[str], perturbation: int) -> None:
    """Watch this process.

    Args:
        notes: the folder where the notes are written.
        tool: the entry of the search path where this tool was imported from.
        bare: names of the modules that were there before.
        perturbation: in which direction initial states are moved; 0: in none.
    """
    sys.path.remove(tool)
    temporary = posix.environ[b"TMPDIR"].decode("utf-8", "surrogateescape")
    root = posix.getcwd()
    installed = [*tracing.installed_folders(), *tracing.library_folders(root, tool)]
    tracer = tracing.Tracer(root, temporary, installed, notes, sink=None)
    mujoco_tracing.tracer = tracer
    sys.meta_path.insert(0, Waiting(perturbation))
    for name in [name for name in sys.modules if name not in bare]:
        if name != "sitecustomize":
            del sys.modules[name]
    tracer.install()
    tracer.begin()


class Waiting:
    """Wraps MuJoCo when it has been imported; first on `sys.meta_path`."""

    def __init__(self, perturbation: int, *, at_end: bool = True) -> None:
        self._perturbation = perturbation
        self._at_end = at_end
        """Whether it has to see to a last look itself."""

    def find_spec(
        self, name: str, path: Any = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """The spec that the other finders find."""
        if name != "mujoco":
            return None
        for finder in sys.meta_path:
            spec = None if finder is self else finder.find_spec(name, path, target)
            if spec is not None:
                if spec.loader is not None:
                    spec.loader = _Loader(spec.loader, self)  # type: ignore[assignment]
                return spec
        return None

    def wrap(self, mujoco: ModuleType) -> None:
        """Let it be watched."""
        if self in sys.meta_path:
            sys.meta_path.remove(self)
        mujoco_tracing.wrap(mujoco, sys.modules["re"])
        mujoco_watching.watch(mujoco)
        if self._perturbation:
            initial_state_perturbation.install(mujoco, sys.modules["numpy"], self._perturbation)
        if self._at_end:
            sys.modules["atexit"].register(mujoco_watching.finish)


class _Loader:
    """Loads as another loader does, and wraps what was loaded."""

    def __init__(self, real: Any, waiting: Waiting) -> None:
        self._real = real
        self._waiting = waiting

    def __getattr__(self, name: str) -> Any:
        return getattr(self._real, name)

    def create_module(self, spec: ModuleSpec) -> Any:
        """A new module."""
        return self._real.create_module(spec)

    def exec_module(self, module: ModuleType) -> None:
        """Fill it."""
        module.__loader__ = self._real
        if module.__spec__ is not None:
            module.__spec__.loader = self._real
        self._real.exec_module(module)
        self._waiting.wrap(module)
