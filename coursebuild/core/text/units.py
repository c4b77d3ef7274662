"""Units as authors write them: `kg m²`, `N*m/rad`, `mm`.

Entry point: `find_unit(text)`. Pint knows them, and is imported when the first one is asked for.
"""

from __future__ import annotations

import functools
from fractions import Fraction
from typing import Any, TypeAlias

from msgspec import Struct

Dimension: TypeAlias = tuple[tuple[str, Fraction], ...]
"""Powers of base quantities, as of length and time, in the order of their names."""


class Unit(Struct, frozen=True):
    """How large a unit is in base units of the SI, and what it measures."""

    size: float
    dimension: Dimension


@functools.lru_cache(maxsize=256)
def find_unit(text: str) -> Unit | None:
    """The unit of a name; `None` where nobody knows it."""
    try:
        base = _registry()(text.replace(" ", "*").replace("·", "*")).to_base_units()
        powers = sorted((str(n), Fraction(p)) for n, p in base.dimensionality.items())
        return Unit(float(base.magnitude), tuple(powers))
    except Exception:  # what Pint's reader of expressions raises is not said anywhere
        return None


@functools.cache
def _registry() -> Any:
    import pint

    return pint.UnitRegistry(cache_folder=None)
