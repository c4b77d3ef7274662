"""Which of some known names a name was meant for: those that few slips of the hand turn into it.

Entry points: `nearest`; `near`, all of them; `distance`, the number of slips.
"""

from __future__ import annotations

from collections.abc import Iterable

from coursebuild.core.text.regex import regex

_LETTERS_PER_SLIP = 3
"""A name of so many letters may have one slip, one of twice as many two, and so on."""


_ID = regex(r"\d+|(?<![^\W_])[^\W\d_](?![^\W_])")


def have_other_ids(first: str, second: str) -> bool:
    """Whether names differ in numbers or single letters, as those of different things do."""
    return _ID.findall(first.lower()) != _ID.findall(second.lower())


def distance(first: str, second: str) -> int:
    """How many letters have to be added, dropped, changed or swapped with the next one.

    This is the distance of Damerau and Levenshtein, in its restricted form.
    """
    two_above: list[int] = []
    above = list(range(len(second) + 1))
    for i, letter in enumerate(first, 1):
        row = [i]
        for j, goal in enumerate(second, 1):
            row.append(min(above[j] + 1, row[-1] + 1, above[j - 1] + (letter != goal)))
            if i > 1 and j > 1 and letter == second[j - 2] and first[i - 2] == goal:
                row[j] = min(row[j], two_above[j - 2] + 1)
        two_above, above = above, row
    return above[-1]


def near(name: str, names: Iterable[str]) -> list[str]:
    """The names that are near enough to have been meant, the nearest first.

    A capital is no slip. Numbers are never near: `1.3` is another lesson than `1.2`.
    """
    if not any(map(str.isalpha, name)):
        return []
    word, ranks = name.lower(), list[tuple[int, int, str]]()
    for candidate in set(names) - {name}:
        slips = max(len(name), len(candidate)) // _LETTERS_PER_SLIP
        if abs(len(name) - len(candidate)) > slips:
            continue
        difference = distance(word, candidate.lower())
        if difference <= slips:
            ranks.append((difference, distance(name, candidate), candidate))
    return [candidate for _, _, candidate in sorted(ranks)]


def nearest(name: str, names: Iterable[str]) -> str | None:
    """The name that was most likely meant; of several that are as near, the first."""
    return next(iter(near(name, names)), None)
