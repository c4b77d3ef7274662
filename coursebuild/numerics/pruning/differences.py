"""What differs between two compiled models, and between their states: all by which code could tell.

Entry points: `ModelDifference`, `difference(whole, changed)`, `state_difference`; `VIEWS`, the
words by which code asks a model for one thing.

The fields are those that MuJoCo's structures have, whatever their names.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Iterator
from typing import Any

import mujoco
import numpy as np
from msgspec import Struct

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


class ModelDifference(Struct, frozen=True):
    """By what code could tell two models apart."""

    fields: frozenset[str] = frozenset()
    """That hold something else."""
    parts: frozenset[tuple[str, str]] = frozenset()
    """Of views on things that are in both, by their kind: `("Sensor", "adr")`."""

    def __or__(self, other: ModelDifference) -> ModelDifference:
        return ModelDifference(self.fields | other.fields, self.parts | other.parts)

    def beyond(self, kinds: frozenset[str]) -> frozenset[str]:
        """Fields that are neither those of these kinds nor lists nor references by number."""
        own = tuple(
            start
            for prefix, size, kind in _prefixes()
            if kind in kinds
            for start in (f"{prefix}_", size)
        )
        return frozenset(
            one
            for one in self.fields
            if not (one.startswith(own) or one.endswith("id") or _LISTS.fullmatch(one))
        )


@functools.cache
def _prefixes() -> tuple[tuple[str, str, str], ...]:
    """Of each kind the prefix of its fields, the field with their number, and its name."""
    found = ((word, f"n{word}", kind) for word, kind in VIEWS.items())
    return tuple(one for one in found if hasattr(mujoco.MjModel, one[1]))


def difference(whole: Any, changed: Any) -> ModelDifference:
    """What differs between two models."""
    return ModelDifference(_fields(whole, changed), frozenset(_parts(whole, changed)))


def state_difference(data: Any, other: Any) -> ModelDifference:
    """What differs between states of two models."""
    return ModelDifference(_fields(data, other))


def _fields(one: Any, other: Any) -> frozenset[str]:
    rest = dict(_leaves(other))
    return frozenset(
        name.rpartition(".")[2] for name, value in _leaves(one) if not _same(value, rest.get(name))
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


def _parts(whole: Any, changed: Any) -> Iterator[tuple[str, str]]:
    """What views say otherwise of things that are in both, which are found by their names."""
    for prefix, size, kind in _prefixes():
        ids, new = _by_name(whole, prefix, size), _by_name(changed, prefix, size)
        both = [name for name in new if name in ids]
        before, after = [ids[name] for name in both], [new[name] for name in both]
        if before != after:
            yield kind, "id"
        for name in _names(type(whole)):  # type: ignore[arg-type]
            if name.startswith(f"{prefix}_"):
                one, other = getattr(whole, name), getattr(changed, name)
                rows = len(one) == getattr(whole, size) and len(other) == getattr(changed, size)
                if rows and one[before].tobytes() != other[after].tobytes():
                    yield kind, name.removeprefix(f"{prefix}_")


def _by_name(model: Any, prefix: str, size: str) -> dict[str, int]:
    """The numbers of all things of a kind that have names."""
    start, names = getattr(model, f"name_{prefix}adr", ()), model.names
    found = {names[at : names.index(0, at)].decode(): i for i, at in enumerate(start)}
    return {name: number for name, number in found.items() if name}
