"""Modules that the fork server has imported, hidden from each script until it imports them itself.

Entry point: `Recorder`. This file is imported before anything else may be, so it imports nothing.

1. While the recorder is on, it notes which module imports which.
2. `hide`, in a script's process, takes away everything that a bare interpreter would not have:
   entries of `sys.modules`, the attributes that importing a submodule sets on its package, warning
   filters, exit functions.
3. `Finder`, first on `sys.meta_path`, puts a module back when the script imports it, along with all
   that importing it imports, so that a script that uses `json` without importing it fails here
   just as it does for its readers.
"""

from __future__ import annotations

import sys

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from importlib.machinery import ModuleSpec
    from types import ModuleType
    from typing import Any

_OWN = "coursebuild"
_UNSEEN = {"numpy.random.bit_generator": ("threading",)}
"""What native code of a module imports and is there already, so that nothing of it is seen."""
_NEEDED = frozenset(("__main__", "builtins", "sys"))


class Recorder:
    """What was imported after the interpreter's start, and by whom."""

    def __init__(self, bare: frozenset[str]) -> None:
        import _warnings
        import atexit
        import builtins

        self.bare = bare
        """Names of the modules that every interpreter has from its start."""
        self.modules: dict[str, ModuleType] = {}
        """The others, in the order of their import, without this tool's own."""
        self.known: dict[str, ModuleType] = {}
        """Both, as they were when they were hidden. A script's process only reads it: to make it
        there, each module's memory would have to be copied first."""
        self.closures: dict[str, tuple[str, ...]] = {}
        self.loaded: list[str] = []
        """Packages that were imported for scripts."""
        self.exits: list[tuple[str, Callable[..., Any], tuple[Any, ...], dict[str, Any]]] = []
        """Exit functions, with the name of the module that registered them."""
        self.filters: list[tuple[str, list[Any]]] = []
        """Warning filters, with the name of the package whose import added them."""
        self.attributes: dict[str, tuple[dict[str, Any], str]] = {}
        """Of a submodule that is hidden, its package's names and its own there, if it had one."""
        self.replayed: set[str] = set()
        """Modules whose import does more than can be seen in `sys.modules`."""
        self._builtins = builtins
        self._import = builtins.__import__
        self._atexit = atexit
        self._register = atexit.register
        self._warnings = _warnings
        self._bare_filters = list(_warnings.filters)
        self._edges: dict[str, dict[str, None]] = {}
        self._looked_for: dict[str, frozenset[str]] = {}
        self._seen = set(sys.modules)
        self._count = len(self._seen)
        self._pending: list[str] = []
        """What is being imported, outermost first."""
        self._bare_cache = dict(sys.path_importer_cache)
        self._bare_path = list(sys.path)
        for name in sorted(self._seen - bare):
            self._edges[name] = {}

    def __enter__(self) -> None:
        self._builtins.__import__ = self._record
        self._atexit.register = self._record_exit  # type: ignore[assignment]

    def __exit__(self, *_: object) -> None:
        self._builtins.__import__ = self._import
        self._atexit.register = self._register

    def load(self, name: str) -> None:
        """Import a package, to have it ready for scripts.

        Raises:
            ImportError, or whatever else the package raises.
        """
        before = list(self._warnings.filters)
        with self:
            __import__(name)
        added = [f for f in self._warnings.filters if f not in before]
        self.filters.append((name, added))
        self.loaded.append(name)

    def settle(self) -> None:
        """Take note of the modules that there are now."""
        own = (_OWN, f"{_OWN}.")
        self.modules = {
            name: module
            for name, module in sys.modules.items()
            if name in self._edges and not (name == own[0] or name.startswith(own[1]))
        }
        self.closures.clear()
        self._looked_for.clear()
        for name in self.loaded:  # every script that imports one needs this
            self.closure(name)
            self.looked_for(name)

    def closure(self, name: str) -> tuple[str, ...]:
        """The modules that are there after a bare interpreter has imported this one."""
        known = self.closures.get(name)
        if known is None:
            found = self._reached(name)
            known = self.closures[name] = tuple(n for n in self.modules if n in found)
        return known

    def looked_for(self, name: str) -> frozenset[str]:
        """Top-level names of the modules that importing this one imports, or tries to."""
        known = self._looked_for.get(name)
        if known is None:
            reached = {each.partition(".")[0] for each in self._reached(name)} - self.bare
            known = frozenset(
                each
                for each in reached  # not what C code made up
                if each not in self.modules or getattr(self.modules[each], "__spec__", None)
            )
            self._looked_for[name] = known
        return known

    def _reached(self, name: str) -> set[str]:
        found, todo = {name}, [name]
        while todo:
            each = todo.pop()
            new = {*self._edges.get(each, ()), *_UNSEEN.get(each, ())} - found
            found |= new
            todo += new
        return found

    def hide(self) -> None:
        """Make this process look as if nothing had been imported; what is held already still works.

        What is imported from now on is imported anew, until `offer`.
        """
        modules = sys.modules
        self.known = {name: modules[name] for name in self.bare - _NEEDED} | self.modules
        self.attributes.clear()
        for name in [n for n in modules if n not in self.bare]:
            module = modules.pop(name)
            parent_name, _, attribute = name.rpartition(".")
            parent = modules.get(parent_name) or self.modules.get(parent_name)
            if parent is not None and parent.__dict__.get(attribute) is module:
                del parent.__dict__[attribute]
                self.attributes[name] = parent.__dict__, attribute
        sys.path_importer_cache.clear()
        sys.path_importer_cache.update(self._bare_cache)
        self._warnings.filters[:] = self._bare_filters
        self._tell_filters()
        for _, function, _, _ in self.exits:
            self._atexit.unregister(function)
        self.replayed = {*_REFRESHED, *dict(self.filters), *(name for name, *_ in self.exits)}

    def offer(self, told: Callable[[str], None]) -> Finder:
        """Let this process have again what it imports from now on; `told` hears the names."""
        for name in [n for n in sys.modules if n not in self.bare]:
            del sys.modules[name]  # which something that was hidden needed in the meantime
        finder = Finder(self, self._bare_path, told)
        sys.meta_path.insert(0, finder)
        return finder

    def replay(self, name: str) -> None:
        """Do again what the import of a module does besides."""
        for package, added in self.filters:
            if package == name and added:
                self._warnings.filters[:0] = added
                self._tell_filters()
        for package, function, args, keywords in self.exits:
            if package == name:
                self._register(function, *args, **keywords)
        refresh = _REFRESHED.get(name)
        if refresh is not None:
            refresh(self.modules[name])

    def _tell_filters(self) -> None:
        """Let warnings know that the filters are others; the function has had two names."""
        for name in ("_filters_mutated", "_filters_mutated_lock_held"):
            tell = getattr(self._warnings, name, None)
            if tell is not None:
                tell()
                return

    def _record(
        self,
        name: str,
        globals: Mapping[str, object] | None = None,
        locals: Mapping[str, object] | None = None,
        fromlist: Sequence[str] | None = (),
        level: int = 0,
    ) -> ModuleType:
        importer = _executing()
        edges = self._edges.setdefault(importer, {})
        self._notice(importer)  # what C code imported, or was put there by hand
        if level:
            name_of_package = (globals or {}).get("__package__") or ""
            base = str(name_of_package).rsplit(".", level - 1)[0]
            absolute = f"{base}.{name}" if name else base
        else:
            absolute = name
        self._pending.append(absolute)
        try:
            module = self._import(name, globals, locals, fromlist, level)
        finally:
            self._pending.pop()
            self._notice(absolute)
            while absolute:
                edges[absolute] = None
                if fromlist:
                    for item in fromlist:
                        if f"{absolute}.{item}" in sys.modules:
                            edges[f"{absolute}.{item}"] = None
                    fromlist = ()
                absolute = absolute.rpartition(".")[0]
        return module

    def _notice(self, importer: str) -> None:
        """Modules that are new belong to the one that was being imported.

        One whose body is being executed belongs to whoever asked for it, unless that was C code:
        then it belongs to the module that was asked for last.
        """
        if len(sys.modules) == self._count:
            return
        edges = self._edges.setdefault(importer, {})
        for name in [n for n in sys.modules if n not in self._seen]:
            self._seen.add(name)
            self._edges.setdefault(name, {})
            spec = getattr(sys.modules[name], "__spec__", None)
            if name != importer and not getattr(spec, "_initializing", False):
                edges[name] = None
            elif self._pending and not f"{name}.".startswith(f"{self._pending[-1]}."):
                self._edges.setdefault(self._pending[-1], {})[name] = None
        self._count = len(sys.modules)

    def _record_exit(self, function: Callable[..., Any], *args: Any, **keywords: Any) -> Any:
        self.exits.append((_executing(), function, args, keywords))
        return self._register(function, *args, **keywords)


class Finder:
    """Gives a script the modules that its interpreter has already."""

    def __init__(
        self, recorder: Recorder, bare_path: list[str], told: Callable[[str], None]
    ) -> None:
        import _imp

        self._told = told
        self._modules = recorder.known
        self._recorder = recorder
        self._bare_path = frozenset(bare_path)
        self._restored: set[str] = set()
        self._is_frozen = _imp.is_frozen
        self._specs: dict[str, ModuleSpec | None] = {}
        self._stat = sys.modules["posix"].stat

    def find_spec(
        self, name: str, path: object = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """A spec of the module that is there already; `None` where a bare Python has to look."""
        module = self._modules.get(name)
        if module is None or name in self._restored or target is not None:
            return None
        if "." not in name and self._shadowed(name):
            self._restored.add(name)
            return None
        ours, theirs = self._modules, sys.modules
        attributes, replayed = self._recorder.attributes, self._recorder.replayed
        again = []
        for each in self._recorder.closure(name) or (name,):
            if each in self._restored or each in theirs:
                continue
            theirs[each] = ours[each]
            self._restored.add(each)
            if each in attributes:
                names, attribute = attributes[each]
                names[attribute] = ours[each]
            if each in replayed:
                again.append(each)
        for each in again:
            self._recorder.replay(each)
        self._told(name)
        self._specs[name] = getattr(module, "__spec__", None)
        del sys.modules[name]  # until the import that asked is through
        return type(sys.__spec__)(name, self)  # type: ignore[arg-type]

    def withdraw(self) -> None:
        """Take back what was given, so that the end of the interpreter leaves it alone.

        What every Python has is taken too, but for what that end needs. All can be imported again.
        """
        for name in (*self._restored, *self._recorder.bare):
            if name in sys.modules and sys.modules[name] is self._modules.get(name):
                del sys.modules[name]
        self._restored.clear()

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        """The module itself."""
        return self._modules[spec.name]

    def exec_module(self, module: ModuleType) -> None:
        """Give the module back the spec that it was imported with."""
        for name, spec in list(self._specs.items()):
            if self._modules[name] is module:
                module.__spec__ = spec
                del self._specs[name]

    def _shadowed(self, name: str) -> bool:
        """Whether a folder that a script has put before Python's own may hold this module."""
        if name in sys.builtin_module_names or self._is_frozen(name):
            return False
        for entry in sys.path:
            if entry in self._bare_path:
                return False
            for ending in ("", ".py"):
                try:
                    self._stat(f"{entry or '.'}/{name}{ending}")
                except (OSError, ValueError):
                    continue
                return True
        return False


def _executing() -> str:
    """The module whose body is being executed, innermost."""
    frame = sys._getframe(2)
    while frame.f_code.co_name != "<module>" and frame.f_back is not None:
        frame = frame.f_back
    return str(frame.f_globals.get("__name__", ""))


def _reseed(module: ModuleType) -> None:
    module.__dict__["seed"]()


def _main_thread(module: ModuleType) -> None:
    thread = module.__dict__["_main_thread"]
    if hasattr(thread, "_set_native_id"):
        thread._set_native_id()


def _logging_start(module: ModuleType) -> None:
    import time

    now = module.__dict__.get("_startTime")
    module.__dict__["_startTime"] = time.time() if isinstance(now, float) else time.time_ns()


_REFRESHED = {
    "numpy.random.mtrand": _reseed,
    "threading": _main_thread,
    "logging": _logging_start,
}
"""What a module found out when it was imported, and that every process finds out for itself."""
