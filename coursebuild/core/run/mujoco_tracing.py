"""Wrap MuJoCo's functions that open files, so that a `Tracer` notes the files.

Nothing is noted until `tracer` is set. Functions that this version of MuJoCo lacks are skipped. A
wrapper has the name and the documentation of what it wraps, and removes itself from the traceback
of what that raises.
"""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Iterable, Mapping
from types import ModuleType
from typing import Any

from coursebuild.core.run.mujoco_files import ModelFiles
from coursebuild.core.run.tracing import Tracer

CallHook = Callable[[tuple[Any, ...], Mapping[str, Any]], None]
ReturnHook = Callable[[tuple[Any, ...], Mapping[str, Any], Any], None]

tracer: Tracer | None = None
"""The tracer that takes the notes; there are none before it is set."""

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

    def reader(scan: Callable[[ModelFiles, Any], None], *, assets: bool = True) -> CallHook:
        """Notes the files of a model whose path or text is the first argument."""

        def note_files(args: tuple[Any, ...], keywords: Mapping[str, Any]) -> None:
            given_names = _given_names(args, keywords)
            files = ModelFiles(active_tracer().note_read, given_names, assets=assets)
            scan(files, _get_argument(args, keywords, 0, "filename", "xml"))

        return note_files

    def note_binary(args: tuple[Any, ...], keywords: Mapping[str, Any]) -> None:
        name = _decode(_get_argument(args, keywords, 0, "filename"))
        if name not in _given_names(args, keywords):
            active_tracer().note_read(name)

    class_readers: tuple[tuple[Any, str, CallHook], ...] = (
        (model, "from_xml_path", reader(ModelFiles.scan_path)),
        (model, "from_xml_string", reader(ModelFiles.scan_text)),
        (model, "from_binary_path", note_binary),
        (spec, "from_file", reader(ModelFiles.scan_path, assets=False)),
        (spec, "from_string", reader(ModelFiles.scan_text, assets=False)),
    )
    for owner, name, before in class_readers:
        if hasattr(owner, name):
            setattr(owner, name, staticmethod(wrap_function(getattr(owner, name), before)))

    def spec_reader(position: int) -> CallHook:
        return lambda args, keywords: ModelFiles(active_tracer().note_read).scan_spec(
            _get_argument(args, keywords, position, "child")
        )

    def note_library(args: tuple[Any, ...], keywords: Mapping[str, Any]) -> None:
        active_tracer().note_library(_decode(_get_argument(args, keywords, 0, "path", "directory")))

    for name, position in (("compile", 0), ("recompile", 0), ("attach", 1)):
        wrap_method(spec, name, spec_reader(position))
    wrap_method(spec, "to_file", _writer(1))
    wrap_functions(mujoco, ("mj_loadPluginLibrary", "mj_loadAllPluginLibraries"), note_library)
    wrap_functions(mujoco, ("mju_getXMLDependencies",), reader(ModelFiles.scan_path))
    for name, position in _WRITERS:
        wrap_functions(mujoco, (name,), _writer(position))


def _writer(position: int) -> CallHook:
    def note_write(args: tuple[Any, ...], keywords: Mapping[str, Any]) -> None:
        path = _get_argument(args, keywords, position, "filename")
        if path is not None:
            active_tracer().note_write(path)

    return note_write


def wrap_function(
    real: Callable[..., Any],
    before: CallHook | None = None,
    after: ReturnHook | None = None,
    *,
    like: Callable[..., Any] | None = None,
) -> Callable[..., Any]:
    """Wrap a function: call `before` with its arguments, and `after` with its result as well.

    The wrapper has the name of `like`, or else of the function itself.
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
            with contextlib.suppress(Exception):  # the function itself has succeeded
                after(args, keywords, result)
        return result

    for attribute in ("__module__", "__name__", "__qualname__", "__doc__"):
        setattr(wrapper, attribute, getattr(like or real, attribute, None))
    return wrapper


def wrap_functions(
    mujoco: ModuleType,
    names: Iterable[str],
    before: CallHook | None = None,
    after: ReturnHook | None = None,
) -> None:
    """Wrap those of these functions that MuJoCo has, in every module that holds them."""
    for name in names:
        real = getattr(mujoco, name, None)
        if real is not None:
            replace_function(mujoco, name, wrap_function(real, before, after))


def wrap_method(
    owner: Any, name: str, before: CallHook | None, after: ReturnHook | None = None
) -> None:
    """Wrap a method of one of MuJoCo's classes, if it has this method."""
    real = getattr(owner, "__dict__", {}).get(name)
    if real is not None:
        setattr(owner, name, wrap_function(real.__get__(None, owner), before, after))


def replace_function(mujoco: ModuleType, name: str, new: Callable[..., Any]) -> None:
    """Replace one of MuJoCo's functions in every module that holds it."""
    real = getattr(mujoco, name)
    for module in (mujoco, sys.modules.get(real.__module__ or "")):
        if module is not None and module.__dict__.get(name) is real:
            setattr(module, name, new)


def replace_rollout(mujoco: Any, new: Callable[[Callable[..., Any]], Callable[..., Any]]) -> None:
    """Replace MuJoCo's rollout by `new(rollout)`, once a script has imported it.

    Before any rollout, a script asks for the size of a state, or makes data: then is the time.
    """
    is_replaced = False

    def replace_once(args: tuple[Any, ...], keywords: Mapping[str, Any]) -> None:
        nonlocal is_replaced
        owner: Any = getattr(sys.modules.get("mujoco._rollout"), "Rollout", None)
        if owner is not None and not is_replaced:
            is_replaced = True
            owner.rollout = new(owner.__dict__["rollout"].__get__(None, owner))

    wrap_functions(mujoco, ("mj_stateSize", "mj_getState"), replace_once)
    wrap_method(mujoco.MjData, "__init__", replace_once)


def active_tracer() -> Tracer:
    """The tracer, which hooks have: none is called before it is set."""
    assert tracer is not None
    return tracer


def _get_argument(
    args: tuple[Any, ...], keywords: Mapping[str, Any], position: int, *names: str
) -> Any:
    if len(args) > position:
        return args[position]
    return next((keywords[name] for name in names if name in keywords), None)


def _given_names(args: tuple[Any, ...], keywords: Mapping[str, Any]) -> tuple[str, ...]:
    tables = [value for value in (*args[1:], *keywords.values()) if hasattr(value, "keys")]
    return tuple(str(name) for table in tables for name in table.keys())  # noqa: SIM118


def _decode(value: Any) -> str:
    return value.decode("utf-8", "surrogateescape") if isinstance(value, bytes) else value
