"""The part of JavaScript that the code of labs is mostly written in, parsed.

Entry points: `parse_statements(code)`, `parse_expression(code)`.

1. The code is cut into tokens (see `javascript_tokens`).
2. Statements are parsed by descent, expressions by the precedence of their operators. A line end
   ends a statement where JavaScript says so.
3. Functions, objects, `new`, `switch`, tagged templates and all else that the tree
   (`javascript_tree`) has no place for are refused by `UntranslatableError`. Assignments are
   statements here; inside an expression they are refused.

The code has been parsed by V8 before, so what is wrong JavaScript need not be found here.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

from coursebuild.labs.javascript_tokens import Token, UntranslatableError, tokenize
from coursebuild.labs.javascript_tree import (
    Array,
    Assign,
    Binary,
    Block,
    Boolean,
    Call,
    Conditional,
    Declare,
    Evaluate,
    Expression,
    For,
    If,
    Index,
    Jump,
    Member,
    Name,
    Number,
    Spread,
    Statement,
    String,
    Template,
    Unary,
    While,
)

_OPERATORS = {
    "||": 3,
    "&&": 4,
    "|": 5,
    "^": 6,
    "&": 7,
    "==": 8,
    "!=": 8,
    "===": 8,
    "!==": 8,
    "<": 9,
    ">": 9,
    "<=": 9,
    ">=": 9,
    "+": 11,
    "-": 11,
    "*": 12,
    "/": 12,
    "%": 12,
    "**": 13,
}
"""How strongly an operator binds."""
_CONDITIONAL, _POWER, _PREFIX = 2, 13, 14
_ASSIGNING = {"=", "+=", "-=", "*=", "/=", "%=", "**=", "|=", "&=", "^="}
_REFUSED = frozenset(
    "async await case catch class debugger default delete do enum eval export extends finally"
    " function import in instanceof new null of super switch this throw try typeof undefined var"
    " void with yield arguments static implements interface package private protected public"
    " const let if else for while break continue return".split()
)
"""Words that are no variables."""
_DEEPEST = 60


def parse_statements(code: str) -> tuple[Statement, ...]:
    """The statements of a piece of code.

    Raises:
        UntranslatableError: it holds something that is not in the tree.
    """
    return _Parser(tokenize(code)).program()


def parse_expression(code: str) -> Expression:
    """The expression that a piece of code is.

    Raises:
        UntranslatableError: it holds something that is not in the tree.
    """
    parser = _Parser(tokenize(code))
    expression = parser.expression()
    parser.expect_end()
    return expression


class _Parser:
    def __init__(self, tokens: tuple[Token, ...], depth: int = 0) -> None:
        self._tokens = tokens
        self._at = 0
        self._depth = depth

    # --- tokens

    @property
    def _next(self) -> Token:
        return self._tokens[self._at]

    def _is(self, *texts: str) -> bool:
        return self._next.kind in ("punctuator", "name") and self._next.text in texts

    def _take(self, *texts: str) -> bool:
        found = self._is(*texts)
        self._at += found
        return found

    def _expect(self, text: str) -> None:
        if not self._take(text):
            raise self._unexpected()

    def _unexpected(self) -> UntranslatableError:
        if self._next.kind == "end":
            return UntranslatableError("code that ends too early")
        if self._next.kind == "template":
            return UntranslatableError("a template behind a name or a value")
        return UntranslatableError(f"`{self._next.text}`")

    def expect_end(self) -> None:
        if self._next.kind != "end":
            raise self._unexpected()

    # --- statements

    def program(self) -> tuple[Statement, ...]:
        body = self._body(lambda: self._next.kind == "end")
        self.expect_end()
        return body

    def _body(self, over: Callable[[], bool]) -> tuple[Statement, ...]:
        found: list[Statement] = []
        while not over():
            if self._next.kind == "end":
                raise self._unexpected()
            found += self._statement()
        return tuple(found)

    def _statement(self) -> list[Statement]:
        self._depth += 1
        if self._depth > _DEEPEST:
            raise UntranslatableError("code that is nested too deeply")
        try:
            return self._any_statement()
        finally:
            self._depth -= 1

    def _any_statement(self) -> list[Statement]:
        if self._take(";"):
            return []
        if self._is("{"):
            return [Block(self._nested())]
        if self._is("const", "let"):
            found: list[Statement] = list(self._declarations())
            self._end_statement()
            return found
        if self._take("if"):
            return [self._if()]
        if self._take("while"):
            test = self._parenthesized()
            return [While(test, self._nested())]
        if self._take("for"):
            return [self._for()]
        for word in _JUMPS:
            if self._take(word):
                self._end_statement()
                return [Jump(word)]
        found = [self._simple()]
        while self._take(","):
            found.append(self._simple())
        self._end_statement()
        return found

    def _end_statement(self) -> None:
        if self._take(";") or self._is("}") or self._next.kind == "end":
            return
        if not self._next.after_newline:
            raise self._unexpected()

    def _nested(self) -> tuple[Statement, ...]:
        if not self._take("{"):
            return tuple(self._statement())
        body = self._body(lambda: self._is("}"))
        self._expect("}")
        return body

    def _parenthesized(self) -> Expression:
        self._expect("(")
        inner = self.expression()
        self._expect(")")
        return inner

    def _declarations(self) -> list[Declare]:
        constant = self._next.text == "const"
        self._at += 1
        found = [self._declaration(constant)]
        while self._take(","):
            found.append(self._declaration(constant))
        return found

    def _declaration(self, constant: bool) -> Declare:
        name = self._variable()
        self._expect("=")
        return Declare(name, self.expression(), constant)

    def _variable(self) -> str:
        token = self._next
        if token.kind != "name" or token.text in _REFUSED:
            raise self._unexpected()
        self._at += 1
        return token.text

    def _if(self) -> If:
        test = self._parenthesized()
        then = self._nested()
        otherwise = self._nested() if self._take("else") else ()
        return If(test, then, otherwise)

    def _for(self) -> For:
        self._expect("(")
        self._expect("let")
        name = self._variable()
        self._expect("=")
        start = self.expression()
        self._expect(";")
        test = self.expression()
        self._expect(";")
        step = self._simple()
        self._expect(")")
        match test, step:
            case (
                Binary("<" | "<=" | ">" | ">=" as operator, Name(tested), limit),
                Assign((Name(stepped),), "+" | "-" as sign, Number(text)),
            ) if tested == stepped == name and text.isdecimal() and int(text) > 0:
                by = int(text) if sign == "+" else -int(text)
                if (by > 0) == (operator in ("<", "<=")):
                    return For(name, start, operator, limit, by, self._nested())
        raise UntranslatableError("a `for` loop that does not count")

    def _simple(self) -> Statement:
        """An assignment, or an expression for what it does."""
        if self._is("++", "--"):
            operator = self._next.text[0]
            self._at += 1
            return Assign((self.expression(_PREFIX),), operator, Number("1"))
        first = self.expression()
        if self._is("++", "--") and not self._next.after_newline:
            operator = self._next.text[0]
            self._at += 1
            return Assign((first,), operator, Number("1"))
        if not self._is(*_ASSIGNING):
            return Evaluate(first)
        operator = self._next.text[:-1]
        self._at += 1
        targets, value = [first], self.expression()
        while operator == "" and self._take("="):
            targets.append(value)
            value = self.expression()
        return Assign(tuple(targets), operator, value)

    # --- expressions

    def expression(self, least: int = _CONDITIONAL) -> Expression:
        """An expression whose operators bind at least so strongly."""
        self._depth += 1
        if self._depth > _DEEPEST:
            raise UntranslatableError("code that is nested too deeply")
        left = self._prefix()
        while True:
            operator = self._next.text if self._next.kind == "punctuator" else ""
            strength = _OPERATORS.get(operator, 0)
            if strength >= least:
                self._at += 1
                right = self.expression(strength + (strength != _POWER))
                left = Binary(operator, left, right)
            elif operator == "?" and least <= _CONDITIONAL:
                self._at += 1
                then = self.expression()
                self._expect(":")
                left = Conditional(left, then, self.expression())
            else:
                break
        self._depth -= 1
        return left

    def _prefix(self) -> Expression:
        for operator in ("-", "+", "!", "~"):
            if self._take(operator):
                return Unary(operator, self.expression(_PREFIX))
        return self._postfix(self._primary())

    def _postfix(self, whole: Expression) -> Expression:
        while True:
            if self._take("."):
                if self._next.kind != "name":
                    raise self._unexpected()
                whole = Member(whole, self._next.text)
                self._at += 1
            elif self._take("["):
                whole = Index(whole, self.expression())
                self._expect("]")
            elif self._take("("):
                whole = Call(whole, self._arguments())
            else:
                return whole

    def _arguments(self) -> tuple[Expression | Spread, ...]:
        found: list[Expression | Spread] = []
        while not self._take(")"):
            spread = self._take("...")
            value = self.expression()
            found.append(Spread(value) if spread else value)
            if not self._is(")"):
                self._expect(",")
        return tuple(found)

    def _primary(self) -> Expression:
        token = self._next
        match token.kind:
            case "number":
                self._at += 1
                return Number(token.text)
            case "string":
                self._at += 1
                return String(token.text)
            case "template":
                self._at += 1
                return Template(tuple(self._template_part(part) for part in token.parts))
            case "name" if token.text in ("true", "false"):
                self._at += 1
                return Boolean(token.text == "true")
            case "name":
                return Name(self._variable())
            case _ if self._is("("):
                return self._parenthesized()
            case _ if self._take("["):
                return self._array()
            case _:
                raise self._unexpected()

    def _template_part(self, part: str | tuple[Token, ...]) -> str | Expression:
        if isinstance(part, str):
            return part
        parser = _Parser(part, self._depth)
        expression = parser.expression()
        parser.expect_end()
        return expression

    def _array(self) -> Array:
        items: list[Expression] = []
        while not self._take("]"):
            items.append(self.expression())
            if not self._is("]"):
                self._expect(",")
        return Array(tuple(items))


_JUMPS: tuple[Literal["break", "continue", "return"], ...] = ("break", "continue", "return")
