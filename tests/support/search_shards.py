"""A shard of the search's index, read as the browser reads it."""

from __future__ import annotations

_DIGITS = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz-_"


def read_shard(shard: str) -> dict[str, list[tuple[int, int]]]:
    pages_by_term: dict[str, list[tuple[int, int]]] = {}
    for line in shard.split("\n") if shard else ():
        term, _, digits = line.partition(" ")
        page = value = shift = 0
        pages = []
        for digit in digits:
            value |= (_DIGITS.index(digit) & 31) << shift
            shift += 5
            if not _DIGITS.index(digit) & 32:
                page += value >> 4
                pages.append((page, value & 15))
                value = shift = 0
        pages_by_term[term] = pages
    return pages_by_term
