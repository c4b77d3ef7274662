r"""Where the keys, values and tables of a TOML text stand.

Entry points: `Scanner(body, faults).scan()` → `Table`; the positions `Table`, `Sequence`, `Scalar`.

The scanner reads statements in order and builds the tree of tables with the offsets of everything
in it. It takes TOML that is valid; in other text it stops with a `FaultError` at the first thing
that it cannot read, which is how a mistake gets a better place and word than "invalid". Whether a
text is TOML, and what its values are, is for `tomllib` to say.
"""

from __future__ import annotations

import re
from typing import Literal, TypeAlias

from msgspec import Struct, field

from coursebuild.diagnostics import Diagnostic
from coursebuild.source import Excerpt
from coursebuild.syntax.nodes import StringNode
from coursebuild.syntax.toml_fault import FaultError, advice, check_scalar
from coursebuild.syntax.toml_string import read_string

MAX_DEPTH = 64
"""How deep tables and arrays may nest."""

_BLANK = re.compile(r"(?:[ \t\n]+|#[^\n]*)*")
_INLINE_SPACE = re.compile(r"[ \t]*")
_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")
_PLAIN_KEY = re.compile(r"([A-Za-z0-9_-]+)[ \t]*=")
_SCALAR = re.compile(r"[^\n,\]}#]*")


class Scalar(Struct):
    """A number, boolean or date: only its place."""

    start: int
    end: int


class Sequence(Struct):
    """An array, or the tables that share a `[[header]]` (`tables`)."""

    start: int
    end: int
    mark_end: int
    tables: bool
    items: list[Item] = field(default_factory=list)


class Table(Struct):
    """A table. `how` says what made it, which decides what may be added to it."""

    start: int
    end: int
    mark: tuple[int, int]
    """Start and end of its opening."""
    how: Literal["header", "implied", "dotted", "inline"]
    """`implied`: only a header of a table inside it was met so far."""
    members: dict[str, tuple[StringNode, Item]] = field(default_factory=dict)


Item: TypeAlias = Table | Sequence | Scalar | StringNode


class Scanner:
    """Reads one text; `strict` looks at numbers, booleans and dates too, which takes time."""

    def __init__(self, body: Excerpt, faults: list[Diagnostic], *, strict: bool = False) -> None:
        self.body = body
        self.text = body.text
        self.faults = faults
        self.strict = strict

    def scan(self) -> Table:
        """The whole text as a table."""
        root = Table(0, 0, (0, 0), "header")
        path: list[Table | Sequence] = [root]
        at = self._blank(0)
        while at < len(self.text):
            if self.text.startswith("[[", at):
                at, path = self._header(root, at, 2)
            elif self.text[at] == "[":
                at, path = self._header(root, at, 1)
            else:
                table = path[-1]
                assert isinstance(table, Table)
                at = self._pair(table, at, len(path) - 1)
            for container in path:
                container.end = max(container.end, at)
            at = self._line_end(at)
        return root

    # ------------------------------------------------------------------------------- statements

    def _header(self, root: Table, at: int, width: int) -> tuple[int, list[Table | Sequence]]:
        keys, here = self._keys(self._space(at + width))
        closer = "]" * width
        if not self.text.startswith(closer, here):
            kind = "`[[table]]`" if width == 2 else "`[table]`"
            raise self._expected(f"`{closer}` at the end of a {kind} line", here)
        end = here + width
        path = self._walk([root], keys[:-1], "implied")
        last = keys[-1]
        parent = path[-1]
        assert isinstance(parent, Table)
        known = parent.members.get(last.value)
        if width == 2:
            path += self._append(parent, last, at, end)
        elif known is None:
            table = Table(at, end, (at, end), "header")
            parent.members[last.value] = (last, table)
            path.append(table)
        else:
            table = self._open(last, known)
            table.mark, table.how = (at, end), "header"
            path.append(table)
        return end, path

    def _append(self, parent: Table, key: StringNode, at: int, end: int) -> list[Table | Sequence]:
        known = parent.members.get(key.value)
        if known is None:
            sequence = Sequence(at, end, end, tables=True)
            parent.members[key.value] = (key, sequence)
        elif isinstance(known[1], Sequence) and known[1].tables:
            sequence = known[1]
        else:
            raise self._repeated(key, known[0])
        table = Table(at, end, (at, end), "header")
        sequence.items.append(table)
        return [sequence, table]

    def _open(self, key: StringNode, known: tuple[StringNode, Item]) -> Table:
        """The table that a header names again: only one that was merely implied can be opened."""
        if isinstance(known[1], Table) and known[1].how == "implied":
            return known[1]
        raise self._repeated(key, known[0])

    def _pair(self, table: Table, at: int, depth: int) -> int:
        """`key = value` in a table that is `depth` deep; its end."""
        plain = _PLAIN_KEY.match(self.text, at)
        if plain is not None:
            keys = [StringNode(self.body, at, plain.end(1), plain[1], ((0, at),))]
            here = plain.end() - 1
        else:
            keys, here = self._keys(at)
        if self.text[here : here + 1] != "=":
            raise self._expected(f"`=` after the key `{keys[-1].value}`", here)
        inner = self._walk([table], keys[:-1], "dotted")
        target = inner[-1]
        assert isinstance(target, Table)
        known = target.members.get(keys[-1].value)
        if known is not None:
            raise self._repeated(keys[-1], known[0])
        item, end = self._value(self._space(here + 1), depth + len(keys))
        target.members[keys[-1].value] = (keys[-1], item)
        for container in inner:
            container.end = max(container.end, end)
        return end

    def _walk(
        self,
        path: list[Table | Sequence],
        keys: list[StringNode],
        how: Literal["implied", "dotted"],
    ) -> list[Table | Sequence]:
        """Go down by `keys`, making the tables that are missing; in a `[[…]]` into its last one."""
        path = list(path)
        for key in keys:
            table = path[-1]
            assert isinstance(table, Table)
            known = table.members.get(key.value)
            if known is None:
                item: Item = Table(key.start, key.end, (key.start, key.end), how)
                table.members[key.value] = (key, item)
            else:
                item = known[1]
            if isinstance(item, Sequence) and item.tables and how == "implied":
                path.append(item)
                item = item.items[-1]
            closed = ("inline",) if how == "implied" else ("inline", "header")
            if not isinstance(item, Table) or item.how in closed:
                raise self._repeated(key, known[0] if known else key)
            path.append(item)
        return path

    # ------------------------------------------------------------------------------------- keys

    def _keys(self, at: int) -> tuple[list[StringNode], int]:
        """The parts of a dotted key, and the place after it and its space."""
        keys: list[StringNode] = []
        while True:
            key = self._key(at)
            keys.append(key)
            if len(keys) > MAX_DEPTH:
                raise FaultError(key.start, key.end, f"a key has more than {MAX_DEPTH} parts")
            at = self._space(key.end)
            if self.text[at : at + 1] != ".":
                return keys, at
            at = self._space(at + 1)

    def _key(self, at: int) -> StringNode:
        char = self.text[at : at + 1]
        if char and char in "\"'":
            return self._string(at, multiline=False)
        match = _BARE_KEY.match(self.text, at)
        if match is None:
            raise self._expected("a key", at)
        return StringNode(self.body, at, match.end(), match[0], ((0, at),))

    # ----------------------------------------------------------------------------------- values

    def _value(self, at: int, depth: int) -> tuple[Item, int]:
        char = self.text[at : at + 1]
        if char and char in "\"'":
            node = self._string(at, multiline=True)
            return node, node.end
        if char and char in "[{":
            if depth > MAX_DEPTH:
                raise FaultError(at, at + 1, f"tables and arrays nest more than {MAX_DEPTH} deep")
            return self._array(at, depth) if char == "[" else self._inline(at, depth)
        match = _SCALAR.match(self.text, at)
        end = at + len(match[0].rstrip()) if match else at
        if end == at:
            raise self._expected("a value", at)
        if self.strict:
            check_scalar(self.text, at, end)
        return Scalar(at, end), end

    def _array(self, at: int, depth: int) -> tuple[Sequence, int]:
        sequence = Sequence(at, at + 1, at + 1, tables=False)
        here = self._blank(at + 1)
        while not self.text.startswith("]", here):
            if here >= len(self.text):
                raise FaultError(at, at + 1, "`[` is never closed")
            item, end = self._value(here, depth + 1)
            sequence.items.append(item)
            here = self._separator(end, at, "]")
        sequence.end = here + 1
        return sequence, sequence.end

    def _inline(self, at: int, depth: int) -> tuple[Table, int]:
        table = Table(at, at + 1, (at, at + 1), "inline")
        here = self._blank(at + 1)
        while not self.text.startswith("}", here):
            if here >= len(self.text):
                raise FaultError(at, at + 1, "`{` is never closed")
            end = self._pair(table, here, depth)
            here = self._separator(end, at, "}")
        if self.strict and "\n" in self.text[at:here]:
            help = "a longer table has a `[header]` of its own"
            raise FaultError(at, at + 1, "a table in braces stands on one line", help)
        table.end = here + 1
        return table, table.end

    def _separator(self, end: int, opened: int, closer: str) -> int:
        """After a value in brackets: the place of the next one, or of the closing bracket."""
        here = self._blank(end)
        char = self.text[here : here + 1]
        if char == ",":
            return self._blank(here + 1)
        if char == closer:
            return here
        if not char:
            raise FaultError(opened, opened + 1, f"`{self.text[opened]}` is never closed")
        raise self._expected(f"`,` or `{closer}`", here)

    def _string(self, at: int, *, multiline: bool) -> StringNode:
        return read_string(self.body, at, self.faults, multiline=multiline)

    # ----------------------------------------------------------------------------------- spaces

    def _space(self, at: int) -> int:
        match = _INLINE_SPACE.match(self.text, at)
        return match.end() if match else at

    def _blank(self, at: int) -> int:
        match = _BLANK.match(self.text, at)
        return match.end() if match else at

    def _line_end(self, at: int) -> int:
        """After a statement: the place of the next one."""
        here = at if self.text.startswith("\n", at) else self._space(at)
        if self.text[here : here + 1] not in ("", "\n", "#"):
            raise self._expected("the end of the line", here)
        return self._blank(here)

    # ----------------------------------------------------------------------------------- faults

    def _expected(self, what: str, at: int) -> FaultError:
        if self.text[at : at + 1] in ("", "\n"):
            found, end = "the end of the line" if at < len(self.text) else "the end of the file", at
        else:
            word = re.compile(r"[\w.+-]+|.").match(self.text, at)
            end = word.end() if word else at + 1
            found = f"`{self.text[at:end]}`"
        return FaultError(at, end, f"expected {what}, found {found}", advice(self.text, at, what))

    def _repeated(self, key: StringNode, first: StringNode) -> FaultError:
        return FaultError(key.start, key.end, f"`{key.value}` is given twice", first=first)
