"""Where a shown value was printed: its address, and what stands at an address now.

1. An address is the words of a printed line, the heading above it, and the number's place in the
   line. A heading is the last line above that has no number, or ends with a colon.
2. Where several lines have the same words, the numbers of the heading and those that the line
   begins with name it, as few as suffice. Such a name counts only as long as none was replaced by
   another: `0.1` may be a setting, which stays, or a result that another line has by chance now.
3. Lines that nothing tells apart have no address.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from functools import cached_property
from typing import TypeAlias

from msgspec import Struct

from coursebuild.core.model.lesson_record import Address, ShownValue
from coursebuild.core.scripts.bound_numbers import PrintedLine, Window
from coursebuild.core.scripts.lines import MARK, canonicalize, plain_text
from coursebuild.core.text.numbers import scan


def describe_line(address: Address) -> str:
    """The printed line of an address in words."""
    name = f", where it begins with {address.name}" if address.name else ""
    return f"`{address.line}`{name}" + (f" below `{address.heading}`" if address.heading else "")


def shown_values(texts: Iterable[tuple[str, str, str, str]]) -> Iterator[ShownValue]:
    """Values from their path, script, words before and text, in the order of the lesson."""
    values = list(texts)
    counts, earlier = Counter(values), Counter[tuple[str, str, str, str]]()
    for value in values:
        path, script, before, text = value
        yield ShownValue(script, before, text, earlier[value], counts[value], path)
        earlier[value] += 1


def masked(text: str) -> str:
    """A text with `#` for each of its numbers, white space folded."""
    return plain_text(canonicalize(text).skeleton.replace(MARK, " # "))


class _LineKey(Struct, frozen=True):
    heading: str
    words: str
    heading_numbers: tuple[str, ...]
    numbers: tuple[str, ...]


class PrintedText:
    """The lines of one output, in which addresses are made and looked up."""

    def __init__(self, lines: Sequence[PrintedLine]) -> None:
        self.lines = lines
        self._keys: list[_LineKey] = []
        self._by_words: dict[tuple[str, str], list[int]] = {}
        heading, heading_numbers = "", tuple[str, ...]()
        for at, line in enumerate(lines):
            words = masked(line.text)
            numbers = tuple(format(n.value.normalize(), "f") for n in line.numbers)
            key = _LineKey(heading, words, heading_numbers, numbers)
            self._keys.append(key)
            self._by_words.setdefault((heading, words), []).append(at)
            if any(map(str.isalpha, words)) and (not numbers or words.endswith(":")):
                heading, heading_numbers = words, numbers

    def heading(self, line: int) -> str:
        """The heading of a line, by its index."""
        return self._keys[line].heading

    def address(self, window: Window) -> Address | None:
        """The address of printed numbers; `None` where nothing tells their line from others."""
        at = next(i for i, line in enumerate(self.lines) if line is window.line)
        place = window.line.numbers.index(window.numbers[0])
        key = self._keys[at]
        siblings = [self._keys[i] for i in self._by_words[key.heading, key.words]]
        for depth in range(-1, place + 1):
            names = tuple(_name(sibling, depth) for sibling in siblings)
            if names.count(name := _name(key, depth)) == 1:
                names = names if name else ()
                return Address(key.words, place, key.heading, name, names)
        return None

    def find(self, address: Address, count: int) -> Window | None:
        """What stands at an address, `count` numbers; `None` where that is not certain."""
        lines = self._by_words.get((address.heading, address.line), [])
        if address.name and lines:
            depth = len(address.name.split()) - len(self._keys[lines[0]].heading_numbers)
            names = [_name(self._keys[i], depth) for i in lines]
            is_intact = {*names} <= {*address.names} or {*names} >= {*address.names}
            lines = [
                i for i, n in zip(lines, names, strict=True) if is_intact and n == address.name
            ]
        if len(lines) != 1:
            return None
        line = self.lines[lines[0]]
        numbers = line.numbers[address.place : address.place + count]
        return Window(line, numbers) if len(numbers) == count else None

    # --- words that an author types

    def find_words(self, words: str, count: int) -> list[Window]:
        """The numbers, `count` in a row, that are printed right after some words.

        In the words `#` stands for any number; signs around them do not count.
        """
        sought = _words(words)
        return [
            Window(self.lines[at], self.lines[at].numbers[first : first + count])
            for at, first, context in self._contexts
            if first + count <= len(self.lines[at].numbers) and _ends_with(context, sought)
        ]

    def words_before(self, window: Window) -> str:
        """The fewest words before printed numbers by which they are found; empty if none are."""
        place = window.line.numbers.index(window.numbers[0])
        (context,) = (
            words
            for at, first, words in self._contexts
            if self.lines[at] is window.line and first == place
        )
        in_line = context[len(context) - len(_words(window.before)) :]
        masked_words = ["#" if is_number else word for word, is_number in context]
        row_words = [*masked_words]
        if any(is_number for _, is_number in in_line):  # the first number of a line may name it
            at = len(context) - len(in_line) + [is_number for _, is_number in in_line].index(True)
            row_words[at] = context[at][0]
        for words in (masked_words, row_words):
            for start in range(len(words) - 1, -1, -1):
                text = " ".join(words[start:])
                if words[start] != "#" and len(self.find_words(text, 1)) == 1:
                    return text
        return ""

    @cached_property
    def _contexts(self) -> tuple[tuple[int, int, _Words], ...]:
        """Of each number its line, its index there, and all words before it, also the heading's."""
        return tuple(
            (at, first, _words(f"{key.heading} {line.text[: number.start]}"))
            for at, (line, key) in enumerate(zip(self.lines, self._keys, strict=True))
            for first, number in enumerate(line.numbers)
        )


_Words: TypeAlias = tuple[tuple[str, bool], ...]
"""Words and numbers, each with whether it is a number."""


def _words(text: str) -> _Words:
    numbers = scan(text)
    parts: list[tuple[str, bool]] = []
    at = 0
    for number in numbers:
        parts += ((word, False) for word in text[at : number.start].split())
        parts.append((plain_text(number.text), True))
        at = number.end
    parts += ((word, False) for word in text[at:].split())
    bare = (
        (word if is_number else word.strip("=:,;()[]|<>~/"), is_number) for word, is_number in parts
    )
    return tuple((word, is_number) for word, is_number in bare if word)


def _ends_with(context: _Words, sought: _Words) -> bool:
    """Whether words end with others, in which `#` is any number."""
    pairs = zip(reversed(context), reversed(sought), strict=False)
    return 0 < len(sought) <= len(context) and all(
        word == sought_word or (sought_word == "#" and is_number)
        for (word, is_number), (sought_word, _) in pairs
    )


def _name(key: _LineKey, depth: int) -> str:
    """The numbers of a line's heading and the first `depth` of its own; none for depth -1."""
    return "" if depth < 0 else " ".join(key.heading_numbers + key.numbers[:depth])
