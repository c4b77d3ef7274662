"""Whether the simulations of a script went well, noticed in its own process.

Entry points: `watch`, once MuJoCo has been imported; `finish`, when the script has ended. Nothing
is noted until `mujoco_tracing.tracer` is set.

1. MuJoCo warns before it resets a state that is lost, or goes on with one: that is heard (see
   `mujoco_warnings`), whatever the script resets afterwards, from any thread, and at no cost to a
   step. MuJoCo turns the clock back in no other case.
2. Every `MjData` is looked at when it is reset, when the script has let go of it, and at the end:
   its warning counters, whether its state is finite, and how deep its bodies lie in each other,
   which MuJoCo does not warn of.

To see what the script lets go of, each `MjData` is held here until another is made; while nothing
but this holds it, it is looked at and let go as well.
"""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Mapping
from types import FrameType, ModuleType
from typing import Any

from coursebuild.core.run import initial_state_perturbation, mujoco_tracing
from coursebuild.core.run.mujoco_warnings import Warnings

DEEP = 1.0
"""A contact is deep where the smaller of two geoms has sunk in by more than this part of its
smallest half size: its middle lies in the other one."""

_KINDS = (
    (" in QPOS ", "mjWARN_BADQPOS", "positions"),
    (" in QVEL ", "mjWARN_BADQVEL", "velocities"),
    (" in QACC ", "mjWARN_BADQACC", "accelerations"),
)
"""What MuJoCo's text says, the counter, and what we call it."""
_NEEDED = ("MjData", "_functions", "mjtGeom", "mjtWarning")
_UNNAMED = "MuJoCo Model"
"""What MuJoCo calls a model that its author does not."""
_MOST_NOTES = 16
_MOST_LOOKS = 5000
"""Looks at data that is being reset, which a script may do very often."""
_MOST_HELD = 1 << 26
"""Bytes of data that nobody but this may hold."""


def watch(mujoco: ModuleType) -> None:
    """Watch the simulations of an imported MuJoCo; of a version that has what this needs."""
    global _watch
    if "numpy" not in sys.modules or not all(hasattr(mujoco, name) for name in _NEEDED):
        return
    _watch = _Watch(mujoco)


def finish() -> None:
    """Look at every `MjData` that there is: the script has come to its end."""
    if _watch is not None and mujoco_tracing.tracer is not None:
        with contextlib.suppress(Exception):  # the script's own end must not fail for this
            _watch.finish()


_watch: _Watch | None = None


class _Watch:
    """Hears of warnings, and of data that is made and reset, once it is made."""

    def __init__(self, mujoco: ModuleType) -> None:
        self._mujoco = mujoco
        self._numpy = sys.modules["numpy"]
        types = mujoco.mjtGeom
        self._flat = [int(types.mjGEOM_PLANE), int(types.mjGEOM_HFIELD)]
        """The types of geoms that have no inside to be deep in."""
        self._held: dict[int, Any] = {}
        self._enough = 2
        """How many are held before some are let go."""
        self._notes = 0
        self._looks = 0
        self._warned: set[str] = set()
        self._told: set[tuple[int, str]] = set()
        data, wrap = mujoco.MjData, mujoco_tracing.wrap_method
        for name in ("__init__", "__setstate__"):
            wrap(data, name, None, self._made_self)
        for name in ("__copy__", "__deepcopy__"):
            wrap(data, name, None, lambda args, keywords, made: self._made(made))
        spec = getattr(mujoco, "MjSpec", None)  # there was none before MuJoCo 3.2
        wrap(spec, "recompile", None, lambda args, keywords, made: self._made(made[1]))
        resets = ("mj_resetData", "mj_resetDataKeyframe", "mj_resetDataDebug")
        mujoco_tracing.wrap_functions(mujoco, resets, self._reset)
        self._warnings = Warnings(mujoco, self._heard)  # which the library calls as long as it is
        self._warnings.install()

    def finish(self) -> None:
        for key in list(self._held):
            self._look_last(self._held.pop(key))

    # --- warnings

    def _heard(self, message: str) -> None:
        if mujoco_tracing.tracer is None:
            return
        try:
            for text, _, kind in _KINDS:
                if text in message:
                    self._warned.add(kind)
                    time = message.rpartition("Time = ")[2].rstrip(". ")
                    self._note(kind, "", time, self._model_at(time))
        except Exception:  # the script's own step must not fail for this
            pass

    def _model_at(self, time: str) -> str:
        """The name of the model whose clock shows this time, if there is only one."""
        names = {_name(data) for data in list(self._held.values()) if f"{data.time:.4f}" == time}
        return names.pop() if len(names) == 1 else ""

    # --- looks

    def _made_self(self, args: tuple[Any, ...], keywords: Mapping[str, Any], made: Any) -> None:
        self._made(args[0])

    def _made(self, data: Any) -> None:
        self._held[id(data)] = data
        if len(self._held) > self._enough or self._size() > _MOST_HELD:
            self._let_go()
            self._enough = max(2, 2 * len(self._held))

    def _size(self) -> int:
        return sum(int(data.nbuffer) for data in list(self._held.values())[:_MOST_NOTES])

    def _let_go(self) -> None:
        """Look at data that nobody but this holds, and hold it no longer."""
        alone = _references({0: object()}, 0)
        for key in list(self._held):
            if _references(self._held, key) <= alone:
                self._look_last(self._held.pop(key))
                self._told = {told for told in self._told if told[0] != key}

    def _reset(self, args: tuple[Any, ...], keywords: Mapping[str, Any]) -> None:
        if self._looks < _MOST_LOOKS:
            self._looks += 1
            self._look(args[1] if len(args) > 1 else keywords["d"])

    def _look_last(self, data: Any) -> None:
        self._look(data)
        initial_state_perturbation.last_look(data)

    def _look(self, data: Any) -> None:
        """Note what is wrong with a simulation, once for each of them."""
        time = data.time
        if time == 0:
            return
        mujoco, finite = self._mujoco, self._numpy.isfinite
        for _, counter, kind in _KINDS:
            count = data.warning[int(getattr(mujoco.mjtWarning, counter))].number
            if count and kind not in self._warned:  # by a handler that we do not know of
                self._once(data, kind, "")
        if not all(finite(values).all() for values in (data.qpos, data.qvel, data.act)):
            self._once(data, "state", "")
        elif data.ncon and hasattr(data, "model"):
            self._contacts(data)

    def _contacts(self, data: Any) -> None:
        contact, model, numpy = data.contact, data.model, self._numpy
        distance, pairs = contact.dist, contact.geom
        halves = model.geom_aabb[:, 3:].min(axis=1)
        sizes = numpy.where(numpy.isin(model.geom_type, self._flat), numpy.inf, halves)
        both = (pairs >= 0).all(axis=1) & (contact.efc_address >= 0)
        smaller = numpy.where(both, sizes[pairs].min(axis=1), numpy.inf)
        parts = -distance / smaller
        worst = int(parts.argmax())
        if not parts[worst] > DEEP:
            return
        names = [_geom(model, int(geom)) for geom in pairs[worst]]
        self._once(data, "contact", f"{-distance[worst]:.2g}\x1f{names[0]}\x1f{names[1]}")

    def _once(self, data: Any, kind: str, detail: str) -> None:
        key = id(data), kind
        if key not in self._told:
            self._told.add(key)
            self._note(kind, detail, f"{data.time:.6g}", _name(data))

    # --- notes

    def _note(self, kind: str, detail: str, time: str, model: str) -> None:
        self._notes += 1
        tracer = mujoco_tracing.tracer
        if tracer is None or self._notes > _MOST_NOTES:
            return
        path, line = _script_line(tracer.root)
        parts = (kind, detail, time, model, path, str(line))
        fields = (part.replace("\t", " ").replace("\0", "") for part in parts)
        tracer.note("d" + "\t".join(fields))


def _references(held: Mapping[int, object], key: int) -> int:
    """How many hold a value, with those of this function."""
    value = held[key]
    return sys.getrefcount(value)


def _name(data: Any) -> str:
    """The name of a model; empty where it has none of its own."""
    if not hasattr(data, "model"):  # before MuJoCo 3.1
        return ""
    name = str(data.model.names.partition(b"\0")[0], "utf-8", "replace")
    return "" if name == _UNNAMED else name


def _geom(model: Any, index: int) -> str:
    name = model.geom(index).name
    return f"`{name}`" if name else f"geom {index}"


def _script_line(root: str) -> tuple[str, int]:
    """The innermost line of a script that is being executed: its path in the project, its number.

    In a thread of MuJoCo's own there is none: then that of the one thread that has one.
    """
    found = _place(sys._getframe(2), root)
    if found is not None:
        return found
    places = [_place(frame, root) for frame in sys._current_frames().values()]
    known = [place for place in places if place is not None]
    return known[0] if len(known) == 1 else ("", 0)


def _place(frame: FrameType | None, root: str) -> tuple[str, int] | None:
    while frame is not None:
        path = frame.f_code.co_filename.removeprefix(root)
        if path.startswith("examples/"):
            return path, frame.f_lineno
        frame = frame.f_back
    return None
