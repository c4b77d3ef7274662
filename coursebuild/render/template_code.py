"""Python of a template, from the tree that Jinja's parser makes of it.

Entry point: `python_of(text)`: a function `root(c, include)` of the template's values and of a
function that renders another template. What else it calls is in `templates`.

Of Jinja's language our templates use a part, and what is no part of that is a mistake of who wrote
the template (`TypeError`). Where this has a meaning it is Jinja's; tests hold it to that.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager

from jinja2 import Environment, nodes
from markupsafe import escape

_COMPARED = {
    "eq": "==",
    "ne": "!=",
    "gt": ">",
    "gteq": ">=",
    "lt": "<",
    "lteq": "<=",
    "in": "in",
    "notin": "not in",
}
_LOOP = {"first": "(not i{0})", "last": "(i{0} == n{0})", "index": "(i{0} + 1)", "index0": "i{0}"}


def python_of(text: str) -> str:
    """The Python of a template."""
    environment = Environment(
        autoescape=True, trim_blocks=True, lstrip_blocks=True, keep_trailing_newline=True
    )
    writer = _Writer()
    writer.statements(environment.parse(text).body)
    return writer.source()


class _Writer:
    """Writes statements; what is only text and values is gathered first."""

    def __init__(self) -> None:
        self._lines: list[str] = []
        self._depth = 1
        self._pieces: list[str] = []
        """Expressions that are texts, to be written next."""
        self._scopes: list[dict[str, str]] = [{}]
        """Python's names of what templates call so, from the outside in."""
        self._count = 0

    def source(self) -> str:
        """The whole function."""
        self._flush()
        lines = ["def root(c, include):", "    out = []", *self._lines]
        return "\n".join([*lines, '    return "".join(out)', ""])

    def statements(self, body: Sequence[nodes.Node]) -> None:
        """Statements one after the other."""
        for node in body:
            self._statement(node)

    def _line(self, text: str) -> None:
        self._flush()
        self._lines.append("    " * self._depth + text)

    def _flush(self) -> None:
        if self._pieces:
            pieces, self._pieces = self._pieces, []
            self._lines.append("    " * self._depth + f"out += ({', '.join(pieces)},)")

    @contextmanager
    def _inside(self, head: str) -> Iterator[None]:
        """A block of Python."""
        self._line(head)
        self._depth += 1
        before = len(self._lines)
        yield
        self._flush()
        if len(self._lines) == before:
            self._line("pass")
        self._depth -= 1

    def _statement(self, node: nodes.Node) -> None:
        match node:
            case nodes.Output():
                for one in node.nodes:
                    self._output(one)
            case nodes.If():
                self._if(node)
            case nodes.For():
                self._for(node)
            case nodes.With():
                self._with(node)
            case nodes.AssignBlock():
                self._set(node)
            case nodes.Include(template=nodes.Const(value=name)) if isinstance(name, str):
                self._pieces.append(f"include({name!r}, {self._seen()})")
            case _:
                raise _unknown(node)

    def _output(self, node: nodes.Expr) -> None:
        match node:
            case nodes.TemplateData():
                self._pieces.append(repr(node.data))
            case nodes.Const():
                self._pieces.append(repr(str(escape(node.value))))
            case _:
                self._pieces.append(f"said({self._value(node)})")

    def _if(self, node: nodes.If) -> None:
        with self._inside(f"if {self._value(node.test)}:"):
            self.statements(node.body)
        for other in node.elif_:
            with self._inside(f"elif {self._value(other.test)}:"):
                self.statements(other.body)
        if node.else_:
            with self._inside("else:"):
                self.statements(node.else_)

    def _for(self, node: nodes.For) -> None:
        if node.recursive:
            raise _unknown(node)
        values = self._value(node.iter)
        number = self._next()
        scope: dict[str, str] = {}
        target = self._target(node.target, number, scope)
        counted = any(name.name == "loop" for body in node.body for name in _names(body))
        self._scopes.append(scope)
        if node.test is not None:
            values = f"[{target} for {target} in {values} if {self._value(node.test)}]"
        if counted or node.else_:
            self._line(f"s{number} = list({values})")
            values = f"s{number}"
        if counted:
            scope["loop"] = str(number)
            self._line(f"n{number} = len({values}) - 1")
            head = f"for i{number}, {target} in enumerate({values}):"
        else:
            head = f"for {target} in {values}:"
        with self._inside(head):
            self.statements(node.body)
        self._scopes.pop()
        if node.else_:
            with self._inside(f"if not s{number}:"):
                self.statements(node.else_)

    def _target(self, node: nodes.Node, number: int, scope: dict[str, str]) -> str:
        """What a loop sets, with the names noted."""
        if isinstance(node, nodes.Tuple):
            parts = (self._target(one, number, scope) for one in node.items)
            return f"({''.join(f'{part}, ' for part in parts)})"
        if not isinstance(node, nodes.Name):
            raise _unknown(node)
        scope[node.name] = f"l{number}_{node.name}"
        return scope[node.name]

    def _with(self, node: nodes.With) -> None:
        number, scope = self._next(), dict[str, str]()
        for target, value in zip(node.targets, node.values, strict=True):
            said = self._value(value)  # before any of the names means another thing
            self._line(f"{self._target(target, number, scope)} = {said}")
        self._scopes.append(scope)
        self.statements(node.body)
        self._flush()
        self._scopes.pop()

    def _set(self, node: nodes.AssignBlock) -> None:
        if node.filter is not None or len(self._scopes) > 1 or self._depth > 1:
            raise _unknown(node)
        number = self._next()
        self._line(f"w{number}, out = out, []")
        self.statements(node.body)
        target = self._target(node.target, number, self._scopes[-1])
        self._line(f'{target}, out = Markup("".join(out)), w{number}')

    def _seen(self) -> str:
        """All that a template sees which is included here."""
        own = {name: python for scope in self._scopes for name, python in scope.items()}
        own.pop("loop", None)
        more = "".join(f", {name!r}: {python}" for name, python in own.items())
        return f"{{**c{more}}}" if more else "c"

    def _next(self) -> int:
        self._count += 1
        return self._count

    # --- expressions

    def _value(self, node: nodes.Node) -> str:
        match node:
            case nodes.Const():
                return repr(node.value)
            case nodes.Name():
                return self._name(node.name)
            case nodes.Getattr(node=nodes.Name(name="loop")):
                number = self._name("loop")
                if node.attr not in _LOOP or not number.isdigit():
                    raise _unknown(node)
                return _LOOP[node.attr].format(number)
            case nodes.Getattr():
                return f"{self._value(node.node)}.{node.attr}"
            case nodes.Getitem():
                return f"{self._value(node.node)}[{self._value(node.arg)}]"
            case nodes.Call(dyn_args=None, dyn_kwargs=None):
                named = (f"{one.key}={self._value(one.value)}" for one in node.kwargs)
                given = ", ".join((*map(self._value, node.args), *named))
                return f"{self._value(node.node)}({given})"
            case nodes.Filter():
                return self._filtered(node)
            case nodes.Test(name="none", args=[], kwargs=[]):
                return f"({self._value(node.node)} is None)"
            case nodes.Tuple():
                return f"({''.join(f'{self._value(one)}, ' for one in node.items)})"
            case _:
                return self._calculated(node)

    def _calculated(self, node: nodes.Node) -> str:
        match node:
            case nodes.Compare():
                others = (f" {_COMPARED[one.op]} {self._value(one.expr)}" for one in node.ops)
                return f"({self._value(node.expr)}{''.join(others)})"
            case nodes.Not():
                return f"(not {self._value(node.node)})"
            case nodes.And():
                return f"({self._value(node.left)} and {self._value(node.right)})"
            case nodes.Or():
                return f"({self._value(node.left)} or {self._value(node.right)})"
            case nodes.Add():
                return f"({self._value(node.left)} + {self._value(node.right)})"
            case nodes.Concat():
                return f"together({', '.join(map(self._value, node.nodes))})"
            case _:
                raise _unknown(node)

    def _name(self, name: str) -> str:
        for scope in reversed(self._scopes):
            if name in scope:
                return scope[name]
        return f"c[{name!r}]"

    def _filtered(self, node: nodes.Filter) -> str:
        assert node.node is not None, "only blocks of filters have none"
        value = self._value(node.node)
        match node.name, node.args, node.kwargs:
            case "length", [], []:
                return f"len({value})"
            case "list", [], []:
                return f"list({value})"
            case "urlencode", [], []:
                return f"quoted({value})"
            case "join", [nodes.Const(value=str(between))], []:
                return f"joined({value}, {between!r})"
            case "selectattr", [nodes.Const(value=str(name))], []:
                return f"[one for one in {value} if one.{name}]"
            case "map", [], [nodes.Keyword(key="attribute", value=nodes.Const(value=str(name)))]:
                return f"[one.{name} for one in {value}]"
            case _:
                raise _unknown(node)


def _names(node: nodes.Node) -> Iterable[nodes.Name]:
    if isinstance(node, nodes.Name):
        yield node
    yield from node.find_all(nodes.Name)


def _unknown(node: nodes.Node) -> TypeError:
    return TypeError(f"templates have no {type(node).__name__} like that in line {node.lineno}")
