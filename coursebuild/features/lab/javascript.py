"""The JavaScript of labs as trees of `tree_sitter`.

V8 has parsed the code before, so mistakes in the JavaScript need no explanation here.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import pairwise

import tree_sitter_javascript
from msgspec import Struct
from tree_sitter import Language, Node, Parser

from coursebuild.api import regex


class UntranslatableError(Exception):
    """JavaScript that this tool cannot write as Python; the text quotes it."""


def refusal(node: Node, kind: str = "") -> UntranslatableError:
    """Make the error for a piece of code, which it names by the first line."""
    return UntranslatableError(f"{kind}`{text_of(node).splitlines()[0]}`")


_ESCAPE = regex(
    r"\\(?:u\{([0-9a-fA-F]+)\}|u([0-9a-fA-F]{4})|x([0-9a-fA-F]{2})|([^ux1-9\r\n\u2028\u2029]))"
)
_NAME = regex(r"[A-Za-z_$][\w$]*", re.ASCII)
_ESCAPED_CHARACTERS = {"n": "\n", "t": "\t", "r": "\r", "b": "\b", "f": "\f", "v": "\v", "0": "\0"}


_PARSER = Parser(Language(tree_sitter_javascript.language()))


def parse(code: str) -> Node:
    """Parse a piece of code, even one with mistakes."""
    return _PARSER.parse(code.encode("utf-8", "replace")).root_node


def walk(node: Node) -> Iterator[Node]:
    """Yield a node and all named nodes inside it."""
    yield node
    for child in node.named_children:
        yield from walk(child)


def parse_statements(code: str) -> list[Node]:
    """Parse a piece of code into its statements; this may raise `UntranslatableError`."""
    if any("\ud800" <= character <= "\udfff" for character in code):
        raise UntranslatableError("half of a character")
    root = parse(code)
    if root.has_error:
        raise UntranslatableError("code that cannot be read")
    for node in walk(root):
        # Python takes other letters for these: it would not see the name that was looked at here.
        if node.type.endswith("identifier") and not _NAME.fullmatch(text_of(node)):
            raise UntranslatableError(f"`{text_of(node)}`, a name not in plain ASCII,")
    return children(root)


def parse_expression(code: str) -> Node:
    """Parse a piece of code that is one expression; this may raise `UntranslatableError`."""
    body = parse_statements(f"({code}\n)")
    if len(body) == 1 and body[0].type == "expression_statement":
        (whole,) = children(body[0])
        if whole.type == "parenthesized_expression":
            return _without_parentheses(whole)
    raise UntranslatableError("code that is not a single expression")


def children(node: Node) -> list[Node]:
    """Return the named children of a node, without comments."""
    return [child for child in node.named_children if child.type != "comment"]


def field(node: Node, name: str) -> Node:
    """Return a part that every node of the type has, without parentheses around it."""
    child = node.child_by_field_name(name)
    assert child is not None, f"{node.type} without {name}"
    return _without_parentheses(child)


def _without_parentheses(node: Node) -> Node:
    while node.type == "parenthesized_expression":
        (node,) = children(node)
    return node


def arguments(call: Node) -> list[Node]:
    """Return the arguments of a call."""
    node = field(call, "arguments")
    if node.type != "arguments":
        raise UntranslatableError("a template behind a name or a value")
    return [_without_parentheses(child) for child in children(node)]


def array_items(array: Node) -> list[Node]:
    """Return the items of an array."""
    signs = [child.type for child in array.children if child.type != "comment"]
    if any(second == "," and first in ("[", ",") for first, second in pairwise(signs)):
        raise UntranslatableError("an array with holes")
    return [_without_parentheses(child) for child in children(array)]


def parameters(function: Node) -> list[str]:
    """Return the names of the parameters of an arrow function, which are nothing else."""
    if function.type != "arrow_function":
        raise refusal(function)
    single = function.child_by_field_name("parameter")
    nodes = children(field(function, "parameters")) if single is None else [single]
    if any(node.type != "identifier" for node in nodes):
        raise refusal(function)
    return [text_of(node) for node in nodes]


def length_of(node: Node) -> Node | None:
    """Return `n` of `{length: n}`, of which `Array.from` makes an array."""
    pairs = children(node) if node.type == "object" else []
    if len(pairs) == 1 and pairs[0].type == "pair" and text_of(field(pairs[0], "key")) == "length":
        return field(pairs[0], "value")
    return None


def pattern_items(pattern: Node) -> list[str]:
    """Return the names in `[a, , b]` on the left of a declaration; `_` for what is left out."""
    names, name = [], "_"
    for child in (child for child in pattern.children if child.type != "comment"):
        if child.type == "identifier":
            name = text_of(child)
        elif child.type == "," or (child.type == "]" and name != "_"):
            names.append(name)
            name = "_"
        elif child.type not in "[]":
            raise refusal(pattern)
    return names


def text_of(node: Node) -> str:
    """Return the source text of a node."""
    assert node.text is not None
    return node.text.decode()


def dotted_names(node: Node) -> tuple[Node, ...]:
    """Return the nodes of the names in `model.opt.timestep`; none if the node is something else."""
    if node.type == "identifier":
        return (node,)
    if node.type != "member_expression" or node.child_by_field_name("optional_chain") is not None:
        return ()
    owner = dotted_names(field(node, "object"))
    return (*owner, field(node, "property")) if owner else ()


def dotted_name(node: Node) -> tuple[str, ...]:
    """Return the names of `model.opt.timestep` as texts."""
    return tuple(map(text_of, dotted_names(node)))


def string_value(node: Node) -> str:
    """Return the value of a string."""
    return "".join(_fragment(child) for child in node.named_children)


def template_parts(template: Node) -> list[str | Node]:
    """Return the texts and the expressions of a template, in order."""
    parts: list[str | Node] = []
    for child in template.named_children:
        if child.type != "template_substitution":
            text = _fragment(child).replace("\r\n", "\n").replace("\r", "\n")
            if parts and isinstance(parts[-1], str):
                text = parts.pop() + text  # type: ignore[operator]
            parts.append(text)
            continue
        (inner,) = children(child)
        parts.append(_without_parentheses(inner))
    return parts


def _fragment(node: Node) -> str:
    text = text_of(node)
    if node.type != "escape_sequence":
        return text
    match = _ESCAPE.fullmatch(text)
    if match is None:
        raise UntranslatableError(f"the escape `{text}`")
    digits = match[1] or match[2] or match[3]
    if digits is None:
        return _ESCAPED_CHARACTERS.get(match[4], match[4])
    number = int(digits, 16)
    if 0xD800 <= number < 0xE000 or number > 0x10FFFF:
        raise UntranslatableError(f"the escape `{text}`")
    return chr(number)


class CountingLoop(Struct, frozen=True):
    """`for (let name = start; name < limit; name += step)`."""

    name: str
    start: Node
    limit: Node
    inclusive: bool
    """Whether the limit itself is reached: `<=` or `>=`."""
    step: int


def counting_loop(node: Node) -> CountingLoop:
    """Read a `for` loop that counts; any other raises `UntranslatableError`."""
    refusal = UntranslatableError("a `for` loop that does not count")
    begin, test = field(node, "initializer"), field(node, "condition")
    step = node.child_by_field_name("increment")
    if begin.type != "lexical_declaration" or test.type != "binary_expression" or step is None:
        raise refusal
    declarators = children(begin)
    start = declarators[0].child_by_field_name("value")
    name, sign, amount = text_of(field(declarators[0], "name")), "", "1"
    if step.type == "update_expression":
        counter, sign = field(step, "argument"), text_of(field(step, "operator"))
    elif step.type == "augmented_assignment_expression":
        counter, sign = field(step, "left"), text_of(field(step, "operator"))
        amount = text_of(field(step, "right"))
    operator = text_of(field(test, "operator"))
    counts = sign in ("++", "--", "+=", "-=") and amount.isdecimal()
    if start is None or len(declarators) > 1 or not counts:
        raise refusal
    if {text_of(counter), text_of(field(test, "left"))} != {name} or int(amount) == 0:
        raise refusal
    if operator not in (("<", "<=") if sign[0] == "+" else (">", ">=")):
        raise refusal
    count = int(amount) if sign[0] == "+" else -int(amount)
    return CountingLoop(name, start, field(test, "right"), operator.endswith("="), count)
