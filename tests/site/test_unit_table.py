"""The units that quizzes read in a page are those of the one table in `core/text/units.py`.

`pytest tests/site/test_unit_table.py --rewrite-fixtures` writes them into the site's half.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from pathlib import Path

import pytest

from coursebuild.core.text.units import UNITS, find_symbol

PAGE_TABLE = Path(__file__).parents[2] / "site/js/quiz/unit-table.js"
HEAD = """\
/**
 * Generated from coursebuild/core/text/units.py by tests/site/test_unit_table.py: symbol, and its
 * scale, powers of the base units, whether it takes prefixes, and where its scale begins (K).
 */
export const UNITS = {
"""
_SYMBOLS = {"length": "m", "mass": "kg", "time": "s", "current": "A", "temperature": "K"}
_SYMBOLS |= {"substance": "mol", "luminosity": "cd", "angle": "rad"}


def rows() -> Iterator[str]:
    """A line for each unit; a revolution is an angle here."""
    for symbol, row in UNITS.items():
        units = find_symbol(symbol)
        if not units:
            continue  # a level has no size
        unit = units[-1] if row.base.startswith("cycle") else units[0]
        size = float(unit.size) * math.pi**unit.pi
        powers = {_SYMBOLS.get(name, name): int(power) for name, power in unit.powers}
        fields = [size, powers, "*" in row.marks, float(unit.size * unit.zero)]
        texts = json.dumps(fields if unit.zero else fields[:3])
        yield f"  {json.dumps(symbol, ensure_ascii=False)}: {texts},\n"


def test_pages_have_the_units_of_the_table(request: pytest.FixtureRequest) -> None:
    text = f"{HEAD}{''.join(rows())}}}\n"
    if request.config.getoption("--rewrite-fixtures"):
        PAGE_TABLE.write_text(text, encoding="utf-8")
    assert PAGE_TABLE.read_text(encoding="utf-8") == text, "run pytest with --rewrite-fixtures"
