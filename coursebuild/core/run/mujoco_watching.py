"""Watch, in the process of a script, whether its simulations go well.

1. MuJoCo warns before it resets a lost state, or goes on with one. The warning is noted from any
   thread, whatever the script resets afterwards, and without making a step slower. MuJoCo turns the
   clock back in no other case.
2. Every `MjData` is checked when it is reset, when the script no longer uses it, and at the end:
   its warning counters, whether its state is finite, and how deep its bodies lie in each other,
   which MuJoCo does not warn of.

To check what the script no longer uses, each `MjData` is held here until another is made; if
nothing else refers to it by then, it is checked and released.
"""

from __future__ import annotations

import contextlib
import posix
import sys
from collections.abc import Callable, Mapping
from types import FrameType, ModuleType
from typing import Any

from coursebuild.core.run import mujoco_tracing, perturbation

DEEP = 1.0
"""A contact is deep where the smaller of two geoms has sunk in by more than this part of its
smallest half size: then its middle lies in the other one."""

_KINDS = (
    (" in QPOS ", "mjWARN_BADQPOS", "positions"),
    (" in QVEL ", "mjWARN_BADQVEL", "velocities"),
    (" in QACC ", "mjWARN_BADQACC", "accelerations"),
)
"""A part of MuJoCo's message, the counter, and our name for the sign."""
_REQUIRED_ATTRIBUTES = ("MjData", "mjtGeom", "mjtWarning", "set_mju_user_warning")
_DEFAULT_MODEL_NAME = "MuJoCo Model"
"""MuJoCo's name for a model that its author has not named."""
_MOST_NOTES = 16
_MOST_CHECKS = 5000
"""The most checks of data that is being reset, which a script may do very often."""
_MOST_HELD = 1 << 26
"""The most bytes of data that are held for checking."""


def watch(mujoco: ModuleType) -> None:
    """Watch the simulations of an imported MuJoCo, if its version has what this needs."""
    global _watch
    if "numpy" in sys.modules and all(hasattr(mujoco, name) for name in _REQUIRED_ATTRIBUTES):
        _watch = _Watch(mujoco)


def finish() -> None:
    """Check every `MjData` that there is, at the end of the script."""
    if _watch is not None and mujoco_tracing.tracer is not None:
        with contextlib.suppress(Exception):  # the script's own end must not fail for this
            _watch.finish()


_watch: _Watch | None = None


class _Watch:
    def __init__(self, mujoco: ModuleType) -> None:
        self._mujoco = mujoco
        self._numpy = sys.modules["numpy"]
        types = mujoco.mjtGeom
        self._flat = [int(types.mjGEOM_PLANE), int(types.mjGEOM_HFIELD)]
        """The types of geoms that have no inside to be deep in."""
        self._data_by_id: dict[int, Any] = {}
        self._release_limit = 2
        """How many are held before unused ones are released."""
        self._notes = 0
        self._checks = 0
        self._warned: set[str] = set()
        self._noted: set[tuple[int, str]] = set()
        data, wrap = mujoco.MjData, mujoco_tracing.wrap_method
        for name in ("__init__", "__setstate__"):
            wrap(data, name, None, lambda args, keywords, result: self._hold(args[0]))
        for name in ("__copy__", "__deepcopy__"):
            wrap(data, name, None, lambda args, keywords, result: self._hold(result))
        spec = getattr(mujoco, "MjSpec", None)  # there was none before MuJoCo 3.2
        wrap(spec, "recompile", None, lambda args, keywords, result: self._hold(result[1]))
        resets = ("mj_resetData", "mj_resetDataKeyframe", "mj_resetDataDebug")
        mujoco_tracing.wrap_functions(mujoco, resets, self._before_reset)
        _Warnings(mujoco, self._note_warning)

    def finish(self) -> None:
        for key in list(self._data_by_id):
            self._check_finally(self._data_by_id.pop(key))

    # --- warnings

    def _note_warning(self, message: str) -> None:
        if mujoco_tracing.tracer is None:
            return
        with contextlib.suppress(Exception):  # the script's own step must not fail for this
            for text, _, kind in _KINDS:
                if text in message:
                    self._warned.add(kind)
                    time = message.rpartition("Time = ")[2].rstrip(". ")
                    # Of the model whose clock shows this time, if there is only one.
                    all_data = list(self._data_by_id.values())
                    names = {_name(data) for data in all_data if f"{data.time:.4f}" == time}
                    self._note(kind, "", time, names.pop() if len(names) == 1 else "")

    # --- checks

    def _hold(self, data: Any) -> None:
        self._data_by_id[id(data)] = data
        size = sum(int(item.nbuffer) for item in list(self._data_by_id.values())[:_MOST_NOTES])
        if len(self._data_by_id) > self._release_limit or size > _MOST_HELD:
            # Check and release data that nothing else refers to
            baseline = _count_references({0: object()}, 0)
            for key in list(self._data_by_id):
                if _count_references(self._data_by_id, key) <= baseline:
                    self._check_finally(self._data_by_id.pop(key))
                    self._noted = {entry for entry in self._noted if entry[0] != key}
            self._release_limit = max(2, 2 * len(self._data_by_id))

    def _before_reset(self, args: tuple[Any, ...], keywords: Mapping[str, Any]) -> None:
        if self._checks < _MOST_CHECKS:
            self._checks += 1
            self._check(args[1] if len(args) > 1 else keywords["d"])

    def _check_finally(self, data: Any) -> None:
        self._check(data)
        perturbation.note_final_state(data)

    def _check(self, data: Any) -> None:
        """Note what is wrong with a simulation, once for each of them."""
        time = data.time
        if time == 0:
            return
        mujoco, finite = self._mujoco, self._numpy.isfinite
        for _, counter, kind in _KINDS:
            count = data.warning[int(getattr(mujoco.mjtWarning, counter))].number
            if count and kind not in self._warned:  # another handler took the warning
                self._note_once(data, kind, "")
        if not all(finite(values).all() for values in (data.qpos, data.qvel, data.act)):
            self._note_once(data, "state", "")
        elif data.ncon:
            self._check_contacts(data)

    def _check_contacts(self, data: Any) -> None:
        contact, model, numpy = data.contact, data.model, self._numpy
        distance, pairs = contact.dist, contact.geom
        halves = model.geom_aabb[:, 3:].min(axis=1)
        sizes = numpy.where(numpy.isin(model.geom_type, self._flat), numpy.inf, halves)
        is_active = (pairs >= 0).all(axis=1) & (contact.efc_address >= 0)
        smaller = numpy.where(is_active, sizes[pairs].min(axis=1), numpy.inf)
        parts = -distance / smaller
        worst = int(parts.argmax())
        if not parts[worst] > DEEP:
            return
        geoms = [(int(geom), model.geom(int(geom)).name) for geom in pairs[worst]]
        names = [f"`{name}`" if name else f"geom {number}" for number, name in geoms]
        self._note_once(data, "contact", f"{-distance[worst]:.2g}\x1f{names[0]}\x1f{names[1]}")

    def _note_once(self, data: Any, kind: str, detail: str) -> None:
        key = id(data), kind
        if key not in self._noted:
            self._noted.add(key)
            self._note(kind, detail, f"{data.time:.6g}", _name(data))

    # --- notes

    def _note(self, kind: str, detail: str, time: str, model: str) -> None:
        self._notes += 1
        tracer = mujoco_tracing.tracer
        if tracer is None or self._notes > _MOST_NOTES:
            return
        place = _innermost_place(sys._getframe(), tracer.root)
        if place is None:  # a thread of MuJoCo's own: it is that of the only thread that has one
            places = [_innermost_place(f, tracer.root) for f in sys._current_frames().values()]
            known_places = [place for place in places if place is not None]
            place = known_places[0] if len(known_places) == 1 else ("", 0)
        path, line = place
        parts = (kind, detail, time, model, path, str(line))
        fields = (part.replace("\t", " ").replace("\0", "") for part in parts)
        tracer.note("d" + "\t".join(fields))


class _Warnings:
    """Calls `on_warning`, which must never fail, with the text of each warning, from any thread.

    MuJoCo's handler of warnings is ours. It calls the handler that the script has set, which is the
    only one that the script sees; or else writes what MuJoCo would have written, in the same place,
    except for `MUJOCO_LOG.TXT`.
    """

    def __init__(self, mujoco: Any, on_warning: Callable[[str], None]) -> None:
        self._on_warning = on_warning
        self._script_handler: Callable[[str], object] | None = None
        """The handler that the script has set."""
        self._set, self._get = mujoco.set_mju_user_warning, mujoco.get_mju_user_warning
        if self._get() is not None:  # set when MuJoCo was imported
            return
        self._set(self._handle)
        for real, new in ((self._set, self._set_handler), (self._get, self._get_handler)):
            wrapper = mujoco_tracing.wrap_function(new, like=real)
            mujoco_tracing.replace_function(mujoco, real.__name__, wrapper)

    def _handle(self, message: str) -> object:
        self._on_warning(message)
        if self._script_handler is not None:
            return self._script_handler(message)
        return posix.write(2, f"WARNING: {message}\n\n".encode("utf-8", "replace"))

    def _set_handler(self, *args: Any, **keywords: Any) -> None:
        handler = args[0] if len(args) == 1 and not keywords else None
        ours = callable(handler) and not hasattr(handler, "restype")  # not a function in C
        try:
            self._set(*((self._handle,) if ours else args), **keywords)
        except BaseException as error:
            if error.__traceback__ is not None:
                error.__traceback__ = error.__traceback__.tb_next
            raise
        self._script_handler = handler if ours else None
        if self._get() is None:
            self._set(self._handle)

    def _get_handler(self, *args: Any, **keywords: Any) -> Any:
        handler = self._get(*args, **keywords)
        return self._script_handler if handler == self._handle else handler


def _count_references(data_by_id: Mapping[int, object], key: int) -> int:
    """How many references there are to a value, with those of this function."""
    value = data_by_id[key]
    return sys.getrefcount(value)


def _name(data: Any) -> str:
    name = str(data.model.names.partition(b"\0")[0], "utf-8", "replace")
    return "" if name == _DEFAULT_MODEL_NAME else name


def _innermost_place(frame: FrameType | None, root: str) -> tuple[str, int] | None:
    """The path in the project and the number of the innermost line of a script, if it has one."""
    while frame is not None:
        path = frame.f_code.co_filename.removeprefix(root)
        if path.startswith("examples/"):
            return path, frame.f_lineno
        frame = frame.f_back
    return None
