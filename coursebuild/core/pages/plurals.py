"""Plural forms: which form of a text goes with a number in a language.

Entry point: `category(language, n)`, one of the categories of CLDR.

Source: the cardinal plural rules of CLDR 48 for whole numbers;
https://www.unicode.org/cldr/charts/48/supplemental/language_plural_rules.html
"""

from __future__ import annotations

from typing import Literal, TypeAlias

Category: TypeAlias = Literal["zero", "one", "two", "few", "many", "other"]

CATEGORIES: tuple[Category, ...] = ("zero", "one", "two", "few", "many", "other")
"""All categories; every language has the last."""


def category(language: str, n: float) -> Category:
    """The form of a text that goes with a number; one with decimals takes `other`.

    A language without interface texts follows English, whose texts it shows.
    """
    if n != int(n):
        return "other"
    n = abs(int(n))
    match language.replace("_", "-").split("-")[0].lower():
        case "ar":
            return _arabic(n)
        case "fr" | "es" if n and n % 1_000_000 == 0:
            return "many"
        case "fr":
            return "one" if n <= 1 else "other"
        case _:
            return "one" if n == 1 else "other"


def _arabic(n: int) -> Category:
    if n <= 2:
        return CATEGORIES[n]
    if 3 <= n % 100 <= 10:
        return "few"
    return "many" if n % 100 >= 11 else "other"
