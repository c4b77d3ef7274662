"""What differs between two compiled models, and between their states, so that code could notice.

Entry points: `difference(whole, variant)`, `unrelated_fields(fields, kinds)`; `VIEWS`, the words by
which code asks a model for one thing.

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
"""Fields in which two equal states may differ."""
_LISTS = re.compile(r"n?names(_map)?|n?paths|nbuffer|narena|name_\w+adr|n?bvh.*")
"""Fields that list the names, paths and boxes of all things, or give sizes of memory."""


def unrelated_fields(fields: frozenset[str], kinds: frozenset[str]) -> frozenset[str]:
    """The fields that neither belong to these kinds nor are lists nor references by number."""
    prefixes = tuple(
        start
        for prefix, size, kind in _prefixes()
        if kind in kinds
        for start in (f"{prefix}_", size)
    )
    return frozenset(
        field
        for field in fields
        if not (field.startswith(prefixes) or field.endswith("id") or _LISTS.fullmatch(field))
    )


@functools.cache
def _prefixes() -> tuple[tuple[str, str, str], ...]:
    """For each kind the prefix of its fields, the field with their number, and its name."""
    prefixes = ((word, f"n{word}", kind) for word, kind in VIEWS.items())
    return tuple(entry for entry in prefixes if hasattr(mujoco.MjModel, entry[1]))


def difference(whole: Any, variant: Any) -> frozenset[str]:
    """The fields that differ between two models, or two states."""
    rest = dict(_leaves(variant))
    return frozenset(
        name.rpartition(".")[2]
        for name, value in _leaves(whole)
        if not _are_same(value, rest.get(name))
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


def _are_same(a: Any, b: Any) -> bool:
    if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
        return a.shape == b.shape and a.tobytes() == b.tobytes()
    return type(a) is type(b) and bool(a == b)
