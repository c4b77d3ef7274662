"""The units that quizzes read in a page, and their names, are those of `core/text/unit_table.py`.

`pytest tests/site/test_unit_table.py --rewrite-fixtures` writes them into the site's half.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import pytest

from coursebuild.core.text.unit_table import NAMES, UNITS
from coursebuild.core.text.units import find_symbol

PAGE_TABLE = Path(__file__).parents[2] / "site/js/quiz/unit-table.json"
_SYMBOLS = {"length": "m", "mass": "kg", "time": "s", "current": "A", "temperature": "K"}
_SYMBOLS |= {"substance": "mol", "luminosity": "cd", "angle": "rad"}


def page_units() -> dict[str, list[Any]]:
    """Of each symbol scale, powers, whether it takes prefixes; a revolution is an angle here."""
    table: dict[str, list[Any]] = {}
    for symbol, row in UNITS.items():
        units = find_symbol(symbol)
        if not units:
            continue  # a level has no size
        unit = units[-1] if row.base.startswith("cycle") else units[0]
        size = float(unit.size) * math.pi**unit.pi
        powers = {_SYMBOLS.get(name, name): int(power) for name, power in unit.powers}
        zero = [float(unit.size * unit.zero)] if unit.zero else []
        table[symbol] = [size, powers, "*" in row.marks, *zero]
    return table


def test_pages_have_the_units_of_the_table(request: pytest.FixtureRequest) -> None:
    units = page_units()
    names = {name: symbol for name, symbol in NAMES.items() if symbol in units}
    text = f"{json.dumps({'units': units, 'names': names}, ensure_ascii=False)}\n"
    if request.config.getoption("--rewrite-fixtures"):
        PAGE_TABLE.write_text(text, encoding="utf-8")
    assert PAGE_TABLE.read_text(encoding="utf-8") == text, "run pytest with --rewrite-fixtures"
