"""MuJoCo's functions that open files, wrapped so that a `Tracer` hears of the files.

Entry point: `wrap`, once MuJoCo has been imported; nothing is noted until `tracer` is set.

What a version of MuJoCo does not have is passed over.

A wrapper has the name and the documentation of what it wraps, and takes itself out of the traceback
of whatever that raises.
"""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Iterable, Mapping
from types import ModuleType
from typing import Any

from coursebuild.core.run.mujoco_files import ModelFiles
from coursebuild.core.run.tracing import Tracer

Before = Callable[[tuple[Any, ...], Mapping[str, Any]], None]
After = Callable[[tuple[Any, ...], Mapping[str, Any], Any], None]

tracer: Tracer | None = None
"""Who takes the notes; nobody does before it is set."""

_WRITERS = (
    ("mj_saveModel", 1),
    ("mj_saveLastXML", 0),
    ("mj_printModel", 1),
    ("mj_printFormattedModel", 1),
    ("mj_printData", 2),
    ("mj_printFormattedData", 2),
    ("mj_printScene", 1),
    ("mj_printFormattedScene", 1),
)
"""Functions that write a file, and the position of its name."""


def wrap(mujoco: ModuleType) -> None:
    """Wrap the functions of an imported MuJoCo."""
    model, spec = getattr(mujoco, "MjModel", None), getattr(mujoco, "MjSpec", None)

    def reader(find: Callable[[ModelFiles, Any], None], *, assets: bool = True) -> Before:
        """Finds the files of a model, of which the first argument is the path or the text."""

        def read(args: tuple[Any, ...], keywords: Mapping[str, Any]) -> None:
            files = ModelFiles(_read, _given(args, keywords), assets=assets)
            find(files, _get(args, keywords, 0, "filename", "xml"))

        return read

    def binary(args: tuple[Any, ...], keywords: Mapping[str, Any]) -> None:
        name = _text(_get(args, keywords, 0, "filename"))
        if name not in _given(args, keywords):
            _read(name)

    of_class: tuple[tuple[Any, str, Before], ...] = (
        (model, "from_xml_path", reader(ModelFiles.of_path)),
        (model, "from_xml_string", reader(ModelFiles.of_text)),
        (model, "from_binary_path", binary),
        (spec, "from_file", reader(ModelFiles.of_path, assets=False)),
        (spec, "from_string", reader(ModelFiles.of_text, assets=False)),
    )
    for owner, name, before in of_class:
        if hasattr(owner, name):
            setattr(owner, name, staticmethod(wrapped(getattr(owner, name), before)))
    for name, position in (("compile", 0), ("recompile", 0), ("attach", 1)):
        wrap_method(spec, name, _spec_reader(position))
    wrap_method(spec, "to_file", _writer(1))
    wrap_functions(mujoco, ("mj_loadPluginLibrary", "mj_loadAllPluginLibraries"), _library)
    wrap_functions(mujoco, ("mju_getXMLDependencies",), reader(ModelFiles.of_path))
    for name, position in _WRITERS:
        wrap_functions(mujoco, (name,), _writer(position))


def _spec_reader(position: int) -> Before:
    """Finds the files of a specification, which is the argument at a position."""
    return lambda args, keywords: ModelFiles(_read).of_spec(_get(args, keywords, position, "child"))


def _library(args: tuple[Any, ...], keywords: Mapping[str, Any]) -> None:
    at = _text(_get(args, keywords, 0, "path", "directory"))
    if tracer is not None:
        tracer.library(at)


def _writer(position: int) -> Before:
    """Notes a file that is written, whose name is at a position."""

    def write(args: tuple[Any, ...], keywords: Mapping[str, Any]) -> None:
        at = _get(args, keywords, position, "filename")
        if at is not None and tracer is not None:
            tracer.write(at)

    return write


def wrapped(
    real: Callable[..., Any],
    before: Before | None = None,
    after: After | None = None,
    *,
    like: Callable[..., Any] | None = None,
) -> Callable[..., Any]:
    """A function that does what another does, and something before, and with its result after.

    `like` is the one whose name it has, where that is another one.
    """

    def wrapper(*args: Any, **keywords: Any) -> Any:
        if before is not None and tracer is not None:
            with contextlib.suppress(Exception):  # MuJoCo says what is wrong with its arguments
                before(args, keywords)
        try:
            result = real(*args, **keywords)
        except BaseException as error:
            if error.__traceback__ is not None:
                error.__traceback__ = error.__traceback__.tb_next
            raise  # which, unlike naming the error, adds no entry to the traceback
        if after is not None and tracer is not None:
            with contextlib.suppress(Exception):  # what was asked for has been done
                after(args, keywords, result)
        return result

    for attribute in ("__module__", "__name__", "__qualname__", "__doc__"):
        setattr(wrapper, attribute, getattr(like or real, attribute, None))
    return wrapper


def wrap_functions(
    mujoco: ModuleType,
    names: Iterable[str],
    before: Before | None = None,
    after: After | None = None,
) -> None:
    """Wrap those of MuJoCo's functions that there are, wherever they are found."""
    for name in names:
        real = getattr(mujoco, name, None)
        if real is not None:
            replace_function(mujoco, name, wrapped(real, before, after))


def wrap_method(owner: Any, name: str, before: Before | None, after: After | None = None) -> None:
    """Wrap a method of one of MuJoCo's classes, if there is such."""
    real = getattr(owner, "__dict__", {}).get(name)
    if real is not None:
        setattr(owner, name, wrapped(real.__get__(None, owner), before, after))


def replace_function(mujoco: ModuleType, name: str, new: Callable[..., Any]) -> None:
    """Put a function in the place of one of MuJoCo's, wherever it is found."""
    real = getattr(mujoco, name)
    for module in (mujoco, sys.modules.get(real.__module__ or "")):
        if module is not None and module.__dict__.get(name) is real:
            setattr(module, name, new)


def replace_rollout(mujoco: Any, new: Callable[[Callable[..., Any]], Callable[..., Any]]) -> None:
    """Put what `new` makes of it in the place of MuJoCo's rollout, once a script has imported that.

    Before a rollout it is asked for the size of a state, or data is made.
    """
    replaced = False

    def look_for(args: tuple[Any, ...], keywords: Mapping[str, Any]) -> None:
        nonlocal replaced
        owner: Any = getattr(sys.modules.get("mujoco._rollout"), "Rollout", None)
        if owner is not None and not replaced:
            replaced = True
            owner.rollout = new(owner.__dict__["rollout"].__get__(None, owner))

    wrap_functions(mujoco, ("mj_stateSize", "mj_getState"), look_for)
    wrap_method(mujoco.MjData, "__init__", look_for)


def note(record: str) -> None:
    """Add a record to the notes, as `Tracer.note` does."""
    if tracer is not None:
        tracer.note(record)


def _read(path: str) -> None:
    if tracer is not None:
        tracer.read(path)


def _get(args: tuple[Any, ...], keywords: Mapping[str, Any], position: int, *names: str) -> Any:
    if len(args) > position:
        return args[position]
    return next((keywords[name] for name in names if name in keywords), None)


def _given(args: tuple[Any, ...], keywords: Mapping[str, Any]) -> tuple[str, ...]:
    """Names of the files that are handed over as bytes."""
    tables = [value for value in (*args[1:], *keywords.values()) if hasattr(value, "keys")]
    return tuple(str(name) for table in tables for name in table.keys())  # noqa: SIM118


def _text(value: Any) -> str:
    return value.decode("utf-8", "surrogateescape") if isinstance(value, bytes) else value
