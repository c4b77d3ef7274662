"""What differs between two compiled models, and between their states: all by which code could tell.

Entry points: `difference(whole, changed)`, `beyond(fields, kinds)`; `VIEWS`, the words by which
code asks a model for one thing.

The fields are those that MuJoCo's structures have, whatever their names.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Iterator
from typing import Any

import mujoco
import numpy as np

_VIEW = re.compile(r"Mj(?:Model|Data)(\w+)Views")
VIEWS: dict[str, str] = {
    word: match[1]
    for structure in (mujoco.MjModel, mujoco.MjData)
    for word in dir(structure)
    if (match := _VIEW.search(getattr(structure, word).__doc__ or "")) is not None
}
"""Words by which one thing is asked for, such as `mat` and `material`, each with its kind."""
_POINTERS = frozenset(("model", "pbase", "parena", "pstack", "signature", "threadpool", "timer"))
"""What two equal states may differ in."""
_LISTS = re.compile(r"n?names(_map)?|n?paths|nbuffer|narena|name_\w+adr|n?bvh.*")
"""What lists the names, paths and boxes of all things, and says how much memory there is."""


def beyond(fields: frozenset[str], kinds: frozenset[str]) -> frozenset[str]:
    """Fields that are neither those of these kinds nor lists nor references by number."""
    own = tuple(
        start
        for prefix, size, kind in _prefixes()
        if kind in kinds
        for start in (f"{prefix}_", size)
    )
    return frozenset(
        one
        for one in fields
        if not (one.startswith(own) or one.endswith("id") or _LISTS.fullmatch(one))
    )


@functools.cache
def _prefixes() -> tuple[tuple[str, str, str], ...]:
    """Of each kind the prefix of its fields, the field with their number, and its name."""
    found = ((word, f"n{word}", kind) for word, kind in VIEWS.items())
    return tuple(one for one in found if hasattr(mujoco.MjModel, one[1]))


def difference(whole: Any, changed: Any) -> frozenset[str]:
    """The fields that hold something else in another model, or another state."""
    rest = dict(_leaves(changed))
    return frozenset(
        name.rpartition(".")[2]
        for name, value in _leaves(whole)
        if not _same(value, rest.get(name))
    )


def _leaves(value: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """The numbers and arrays of a structure, with those of structures in it."""
    for name in _names(type(value)):  # type: ignore[arg-type]
        try:
            inner = getattr(value, name)
        except (AttributeError, ValueError, TypeError):
            continue
        if isinstance(inner, np.ndarray | int | float | bytes):
            yield path + name, inner
        elif type(inner).__module__.startswith("mujoco"):
            yield from _leaves(inner, f"{path}{name}.")


@functools.cache
def _names(structure: type) -> tuple[str, ...]:
    names = (name for name in dir(structure) if not name.startswith("_"))
    return tuple(
        name for name in names if name not in _POINTERS and not callable(getattr(structure, name))
    )


def _same(one: Any, other: Any) -> bool:
    if isinstance(one, np.ndarray) and isinstance(other, np.ndarray):
        return one.shape == other.shape and one.tobytes() == other.tobytes()
    return type(one) is type(other) and bool(one == other)
