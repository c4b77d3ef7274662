"""The words of the interface: one file a language, read as an asset.

Entry point: `parse_strings(text, fallback)`, which gives `Strings`; a template says
`t("lesson.minutes", n=25)`.

1. A file is TOML: tables of texts, addressed by their dotted path. `{name}` in a text is replaced
   by a value.
2. A text that depends on a number is a table with `one` and `other`; the value `n` chooses.
3. A key that a language lacks is taken from English; a key that English lacks is a programming
   error (`KeyError`).
"""

from __future__ import annotations

from collections.abc import Iterator

from coursebuild.values import dataclass, field

DEFAULT_LANGUAGE = "en"


@dataclass(frozen=True, slots=True)
class Strings:
    """The interface's words in one language."""

    entries: tuple[tuple[str, str], ...]
    """Dotted key and text, sorted by key."""
    _table: dict[str, str] = field(repr=False, compare=False, hash=False)

    @classmethod
    def of(cls, table: dict[str, str]) -> Strings:
        """The words of a table: dotted key and text."""
        return cls(tuple(sorted(table.items())), table)

    @property
    def keys(self) -> frozenset[str]:
        """All keys."""
        return frozenset(self._table)

    def __call__(self, key: str, **values: str | int | float) -> str:
        """The text of a key, with its values put in."""
        text = self._table.get(key)
        if text is None and "n" in values:
            text = self._table[f"{key}.one" if values["n"] == 1 else f"{key}.other"]
        if text is None:
            raise KeyError(f"no interface text {key!r}")
        return text.format_map(values) if values else text

    def has(self, key: str) -> bool:
        """Whether there is a text of this key."""
        return key in self._table


def parse_strings(text: str, fallback: Strings | None = None) -> Strings:
    """Read a file of texts; what it lacks comes from `fallback`."""
    table = dict(fallback.entries) if fallback is not None else {}
    import tomllib

    table.update(_flatten(tomllib.loads(text), ""))
    return Strings.of(table)


def _flatten(table: dict[str, object], prefix: str) -> Iterator[tuple[str, str]]:
    for name, value in table.items():
        if isinstance(value, dict):
            yield from _flatten(value, f"{prefix}{name}.")
        elif isinstance(value, str):
            yield prefix + name, value
        else:
            raise TypeError(f"interface text {prefix + name!r} is not a text")
