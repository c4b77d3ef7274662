"""Which of a text's forms a number takes in a language.

Entry point: `category(language, n)`, one of the categories of CLDR.

Source: the cardinal plural rules of CLDR 48, for numbers of things: whole ones, without decimals;
https://www.unicode.org/cldr/charts/48/supplemental/language_plural_rules.html
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal, TypeAlias

Category: TypeAlias = Literal["zero", "one", "two", "few", "many", "other"]

CATEGORIES: tuple[Category, Category, Category, Category, Category, Category] = (
    "zero",
    "one",
    "two",
    "few",
    "many",
    "other",
)
"""All of them; every language has the last."""


def category(language: str, n: float) -> Category:
    """The form of a text that goes with a number of things; a number with decimals takes `other`.

    A language that is not known here is taken to count as English does.
    """
    if n != int(n):
        return "other"
    return _RULES.get(language.replace("_", "-").split("-")[0].lower(), _english)(abs(int(n)))


def _english(n: int) -> Category:
    return "one" if n == 1 else "other"


def _none(n: int) -> Category:
    return "other"


def _up_to_one(n: int) -> Category:
    return "one" if n <= 1 else "other"


def _french(n: int) -> Category:
    return "many" if n and n % 1_000_000 == 0 else _up_to_one(n)


def _spanish(n: int) -> Category:
    return "many" if n and n % 1_000_000 == 0 else _english(n)


def _arabic(n: int) -> Category:
    if n <= 2:
        return CATEGORIES[n]
    if 3 <= n % 100 <= 10:
        return "few"
    return "many" if n % 100 >= 11 else "other"


def _hebrew(n: int) -> Category:
    return "two" if n == 2 else _english(n)


def _east_slavic(n: int) -> Category:
    if n % 10 == 1 and n % 100 != 11:
        return "one"
    return "few" if 2 <= n % 10 <= 4 and not 12 <= n % 100 <= 14 else "many"


def _south_slavic(n: int) -> Category:
    found = _east_slavic(n)
    return "other" if found == "many" else found


def _polish(n: int) -> Category:
    if n == 1:
        return "one"
    return "few" if 2 <= n % 10 <= 4 and not 12 <= n % 100 <= 14 else "many"


def _czech(n: int) -> Category:
    return "few" if 2 <= n <= 4 else _english(n)


def _slovene(n: int) -> Category:
    forms: dict[int, Category] = {1: "one", 2: "two", 3: "few", 4: "few"}
    return forms.get(n % 100, "other")


def _romanian(n: int) -> Category:
    if n == 1:
        return "one"
    return "few" if n == 0 or 1 <= n % 100 <= 19 else "other"


def _lithuanian(n: int) -> Category:
    if 11 <= n % 100 <= 19 or n % 10 == 0:
        return "other"
    return "one" if n % 10 == 1 else "few"


def _latvian(n: int) -> Category:
    if n % 10 == 0 or 11 <= n % 100 <= 19:
        return "zero"
    return "one" if n % 10 == 1 else "other"


_FAMILIES: tuple[tuple[Callable[[int], Category], str], ...] = (
    (_none, "id ja ko lo ms my th vi yue zh"),
    (_up_to_one, "am as bn fa gu hi hy kab kn zu"),
    (_french, "fr pt"),
    (_spanish, "ca es it"),
    (_arabic, "ar ars"),
    (_hebrew, "he iw"),
    (_east_slavic, "be ru uk"),
    (_south_slavic, "bs hr sh sr"),
    (_polish, "pl"),
    (_czech, "cs sk"),
    (_slovene, "sl"),
    (_romanian, "mo ro"),
    (_lithuanian, "lt"),
    (_latvian, "lv prg"),
)
_RULES = {language: rule for rule, languages in _FAMILIES for language in languages.split()}
