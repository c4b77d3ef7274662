"""Values of JSON and TOML that know where they stand, and the words of messages for them.

Both languages give the same nodes, so that one decoder serves both. Nodes compare by identity: two
equal numbers at two places are two nodes. Only their parser changes them.
"""

from __future__ import annotations

import re
import unicodedata
from bisect import bisect_left
from collections.abc import Callable, Iterable, Iterator
from typing import Literal, TypeAlias

import msgspec.inspect as inspect
from msgspec import Struct

from coursebuild.core.text.diagnostics import Diagnostic, Fix, diagnose
from coursebuild.core.text.regex import regex
from coursebuild.core.text.source import Excerpt, Span


class _PositionedNode(Struct, eq=False):
    """A node at `[start, end)` of the text that was parsed."""

    body: Excerpt
    start: int
    end: int

    @property
    def span(self) -> Span:
        return self.body.span(self.start, self.end)

    @property
    def mark(self) -> Span:
        """The part to point at in a message: all of a scalar, the opening of a container."""
        return self.span

    @property
    def raw(self) -> str:
        return self.body.text[self.start : self.end]


class StringNode(_PositionedNode, eq=False):
    """A string, a key included."""

    excerpt: Excerpt
    """The text, escapes resolved, each character with its place: of an escape, its backslash."""

    @property
    def value(self) -> str:
        return self.excerpt.text


class NumberNode(_PositionedNode, eq=False):
    """A number; a float may be infinite or, in TOML, not a number."""

    value: int | float


class BoolNode(_PositionedNode, eq=False):
    """`true` or `false`."""

    value: bool


class NullNode(_PositionedNode, eq=False):
    """JSON's `null`."""


class DateNode(_PositionedNode, eq=False):
    """A date or time of TOML. No field takes one."""


class _Container(_PositionedNode, eq=False):
    """A value that holds others; one of TOML grows until the end of its text."""

    opening: tuple[int, int]
    """The offsets of its bracket, brace or `[header]`; a header may stand below a part of the
    table."""

    @property
    def mark(self) -> Span:
        return self.body.span(*self.opening)


class ArrayNode(_Container, eq=False):
    """A list of values."""

    items: list[Node]


class ObjectNode(_Container, eq=False):
    """A JSON object or a TOML table."""

    members: dict[str, Member]
    """The members by key, as they are written; of a repeated key the first."""

    def get(self, name: str) -> Node | None:
        """The value of a key."""
        member = self.members.get(name)
        return None if member is None else member.value

    def place(self, name: str) -> Span:
        """The part to point at for a field: its value, or the opening if it is not given."""
        value = self.get(name)
        return self.mark if value is None else value.mark

    def items(self, name: str) -> tuple[Node, ...]:
        """The items of the array of that name; none if there is no such array."""
        value = self.get(name)
        return tuple(value.items) if isinstance(value, ArrayNode) else ()

    def objects(self, name: str) -> tuple[ObjectNode, ...]:
        """The objects in the array of that name."""
        return tuple(item for item in self.items(name) if isinstance(item, ObjectNode))

    def object(self, name: str) -> ObjectNode:
        """The object of that name; an empty one if there is none."""
        value = self.get(name)
        if isinstance(value, ObjectNode):
            return value
        return ObjectNode(self.body, self.start, self.end, self.opening, {})

    def strings(self, name: str) -> tuple[StringNode, ...]:
        """The strings in the array of that name."""
        return tuple(item for item in self.items(name) if isinstance(item, StringNode))


class Member(Struct, frozen=True):
    """A key and its value."""

    key: StringNode
    value: Node


Node: TypeAlias = ObjectNode | ArrayNode | StringNode | NumberNode | BoolNode | NullNode | DateNode


_LETTERS = regex(r"[A-Za-z]+")
_DOLLARS = regex(r"(?<!\\)\$+")
_CONTROL = regex(r"[\t\n\b\f\r]")

_COMMANDS = frozenset(
    """
    tag tan tanh tau text textbf textcolor textit textrm textstyle texttt tfrac therefore theta
    tilde times to top triangle nabla natural ne nearrow neg neq nexists ngeq nleq nmid nolimits
    nonumber normalsize not notag notin nparallel nrightarrow nsim nu
    """.split()
)
"""Commands of TeX that begin with `t` or `n`."""


def replace_escapes(
    body: Excerpt, content: tuple[int, int], replacements: Iterable[tuple[re.Match[str], str]]
) -> Excerpt:
    """The content of a string, between two offsets, with a text in place of each escape."""
    parts: list[Excerpt] = []
    position, end = content
    for escape, text in replacements:
        place = ((0, body.offset(escape.start())),)
        parts += (body.slice(position, escape.start()), Excerpt(body.source, text, place))
        position = escape.end()
    return Excerpt.join([*parts, body.slice(position, end)])


def tex_word(text: str, at: int) -> str:
    """The letters from the offset `at` on."""
    match = _LETTERS.match(text, at)
    return match[0] if match else ""


def check_tex_escapes(text: Excerpt, help: Callable[[str], str]) -> Iterator[Diagnostic]:
    r"""Report the escapes of a string that were surely meant for TeX.

    Both languages read `\t`, `\n`, `\b`, `\f` and `\r` as control characters, so that "$\tau$"
    silently becomes a tab and "au". A backspace, form feed or carriage return before a letter has
    no use in a course's text; a tab or a line end has, so these are reported only before the rest
    of a known command. `help` is that for a command.
    """
    value = text.text
    if "$" not in value:
        return
    dollars = [match.start() for match in _DOLLARS.finditer(value)]
    for control in _CONTROL.finditer(value):
        span = text.span(*control.span())
        letter, rest = span.source.text[span.end : span.end + 1], tex_word(value, control.end())
        if not rest or span.text != "\\" or letter not in "tnbfr":
            continue  # no command, no escape, or one by its number
        is_command = letter + rest in _COMMANDS
        in_math = bisect_left(dollars, control.start()) % 2 == 1
        if (is_command and in_math) if letter == "n" else (is_command or in_math or letter != "t"):
            place = span.to(span.source.span(span.end, span.end + 1 + len(rest)))
            message = f"`\\{letter}` of `\\{letter}{rest}` is read as a control character"
            yield diagnose("field-value", place, message, help=help(letter + rest))


def odd_character(char: str) -> str:
    """The name of a character that looks like a space or like nothing; empty for all others."""
    if not char or char in " \t\n\r":
        return ""
    if unicodedata.category(char) in {"Zs", "Zl", "Zp", "Cf", "Cc"}:
        name = unicodedata.name(char, "control character").lower()
        return f"U+{ord(char):04X} ({name})"
    return ""


_MAX_LENGTH = 40
_NUMBER = regex(r"[-+]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][-+]?[0-9]+)?", re.ASCII)


Format: TypeAlias = Literal["JSON", "TOML"]
JSON: Format = "JSON"
TOML: Format = "TOML"
"""The language of a value; messages call the same value an object in JSON and a table in TOML."""

_TYPES: dict[type[inspect.Type], tuple[str, str, type[Node]]] = {
    inspect.StrType: ("a string", "strings", StringNode),
    inspect.LiteralType: ("a string", "strings", StringNode),
    inspect.IntType: ("an integer", "integers", NumberNode),
    inspect.FloatType: ("a number", "numbers", NumberNode),
    inspect.BoolType: ("`true` or `false`", "`true` or `false`", BoolNode),
    inspect.DictType: ("an object", "objects", ObjectNode),
    inspect.StructType: ("an object", "objects", ObjectNode),
    inspect.VarTupleType: ("an array", "arrays", ArrayNode),
    inspect.TupleType: ("an array", "arrays", ArrayNode),
    inspect.NoneType: ("", "", NullNode),
}
"""The words for one value and for several of a type, and the type of its node."""
_KINDS_OF_NODES: dict[type[Node], str] = {
    ObjectNode: "an object",
    ArrayNode: "an array",
    StringNode: "a string",
    DateNode: "a date or time",
}


def _union_members(type: inspect.Type) -> list[inspect.Type]:
    """The types of a union for a message, without `null`, and with one struct for all of them."""
    while isinstance(type, inspect.Metadata):
        type = type.type
    if not isinstance(type, inspect.UnionType):
        return [type]
    types = [member for inner in type.types for member in _union_members(inner)]
    structs = [member for member in types if isinstance(member, inspect.StructType)]
    return [t for t in types if not isinstance(t, inspect.NoneType) and t not in structs[1:]]


def _describe_type(type: inspect.Type) -> tuple[str, str]:
    singulars, plurals = [], []
    for member in _union_members(type):
        singular, plural, _ = _TYPES[member.__class__]
        content = ""
        if isinstance(member, inspect.VarTupleType):
            content = f" of {_describe_type(member.item_type)[1]}"
        elif isinstance(member, inspect.TupleType):
            content = f" of {len(member.item_types)} values"
        singulars.append(singular + content)
        plurals.append(plural + content)
    return " or ".join(singulars), " or ".join(plurals)


def accepts(type: inspect.Type, node: Node) -> bool:
    """Whether a node is of a type, whatever its value."""
    if isinstance(type, inspect.Metadata):
        return accepts(type.type, node)
    if isinstance(type, inspect.UnionType):
        return any(accepts(member, node) for member in type.types)
    if isinstance(type, inspect.IntType) and isinstance(node, NumberNode):
        return isinstance(node.value, int)
    return isinstance(node, _TYPES[type.__class__][2])


def shorten(text: str) -> str:
    """A text of the author on one line, cut to a length that fits into a message."""
    line = " ".join(text.split())
    return line if len(line) <= _MAX_LENGTH else line[: _MAX_LENGTH - 1] + "…"


def format_name(name: str) -> str:
    """The name of a field in a message; "the quiz", which is no field, stays as it is."""
    return name if name.startswith("the ") else f"`{shorten(name)}`"


def format_value(node: Node) -> str:
    """A value in a message, as the author wrote it."""
    return f"`{shorten(node.value if isinstance(node, StringNode) else node.raw)}`"


def wrong_type_message(node: Node, name: str, type: inspect.Type, format: Format) -> str:
    """The message for a value of the wrong type."""
    value = _KINDS_OF_NODES.get(node.__class__, f"`{shorten(node.raw)}`")
    if isinstance(node, NumberNode):
        value = f"the number {shorten(node.raw)}"
    problem = f"must be {_describe_type(type)[0]}, not {value}"
    if format == TOML:
        problem = problem.replace("an object", "a table").replace("objects", "tables")
    return f"{format_name(name)} {problem}"


def type_help(node: Node, type: inspect.Type) -> str:
    """How to mend a value of the wrong type, if that is clear."""
    raw = node.raw
    members = _union_members(type)
    kinds = {_TYPES[member.__class__][2] for member in members}
    if isinstance(node, NullNode):
        return "leave the field out"
    if len(raw) > _MAX_LENGTH or "\n" in raw:
        return ""
    is_bare = isinstance(node, NumberNode | DateNode | BoolNode)
    if is_bare and StringNode in kinds and (len(kinds) == 1 or not isinstance(node, BoolNode)):
        return Fix(f'put it between quotes: `"{raw}"`', f'"{raw}"', raw, safe=True)
    if isinstance(node, StringNode):
        if NumberNode in kinds and _NUMBER.fullmatch(node.value):
            help = f"write it without quotes: `{node.value}`"
            return Fix(help, node.value, raw, safe=True)
        if BoolNode in kinds and node.value.lower() in ("true", "false"):
            new = node.value.lower()
            return Fix(f"write it without quotes: `{new}`", new, raw, safe=True)
    return ""
