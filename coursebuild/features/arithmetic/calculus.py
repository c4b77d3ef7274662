r"""Derivatives of expressions, by the chain rule.

Entry point: `differentiate(expression, name)`.
"""

from __future__ import annotations

from functools import cache

from msgspec.structs import replace

from coursebuild.features.arithmetic.expressions import Expression
from coursebuild.features.arithmetic.tex import read_expression

_PARTIAL_DERIVATIVES = {
    "+": ("1", "1"),
    "-": ("1", "-1"),
    "*": ("w", "u"),
    "/": (r"\frac1w", r"-\frac{u}{w^2}"),
    "^": ("w u^{w - 1}", r"u^w\,\ln(u)"),
    "abs": (r"\frac{u}{|u|}",),
    "sin": (r"\cos(u)",),
    "cos": (r"-\sin(u)",),
    "tan": (r"\sec^2(u)",),
    "cot": (r"-\csc^2(u)",),
    "sec": (r"\sec(u)\tan(u)",),
    "csc": (r"-\csc(u)\cot(u)",),
    "sinh": (r"\cosh(u)",),
    "cosh": (r"\sinh(u)",),
    "tanh": (r"1 - \tanh^2(u)",),
    "arcsin": (r"\frac{1}{\sqrt{1 - u^2}}",),
    "arccos": (r"-\frac{1}{\sqrt{1 - u^2}}",),
    "arctan": (r"\frac{1}{1 + u^2}",),
    "exp": (r"\exp(u)",),
    "ln": (r"\frac1u",),
}
"""Of each operation and function of `u`, or of `u` and `w`, by its arguments."""


def differentiate(expression: Expression, name: str) -> Expression:
    """Return the derivative by a symbol.

    Raises:
        NotUnderstood: it is not known.
    """
    kind, parts = expression.kind, expression.parts
    start, end = expression.start, expression.end
    if kind == "symbol" or name not in expression.names():
        return Expression(
            "number", start, end, text="1" if kind == "symbol" and expression.text == name else "0"
        )
    if kind == "derivative":
        return differentiate(differentiate(parts[0], parts[1].text), name)
    if kind == "integral" and len(parts) == 4:
        return _differentiate_integral(expression, name)
    if kind == "sum" and not any(name in limit.names() for limit in parts[2:]):
        return replace(expression, parts=(differentiate(parts[0], name), *parts[1:]))
    if kind == "-" and len(parts) == 1:
        return replace(expression, parts=(differentiate(parts[0], name),))
    if kind not in _PARTIAL_DERIVATIVES:
        raise expression.not_understood("its derivative is not known")
    arguments = dict(zip("uw", parts, strict=False))
    terms = []
    for tex, part in zip(_PARTIAL_DERIVATIVES[kind], parts, strict=True):
        if name in part.names():
            partial = replace(read_partial(tex).substitute(arguments), start=start, end=end)
            terms.append(Expression("*", start, end, (partial, differentiate(part, name))))
    return terms[0] if len(terms) == 1 else Expression("+", start, end, tuple(terms))


def _differentiate_integral(integral: Expression, name: str) -> Expression:
    """Return what the limits give, and the integral of the derivative."""
    integrand, variable, *limits = integral.parts
    start, end = integral.start, integral.end
    first, last = (
        Expression(
            "*",
            start,
            end,
            (integrand.substitute({variable.text: limit}), differentiate(limit, name)),
        )
        for limit in limits
    )
    total = Expression("-", start, end, (last, first))
    if variable.text == name or name not in integrand.names():
        return total
    inner = replace(integral, parts=(differentiate(integrand, name), variable, *limits))
    return Expression("+", start, end, (total, inner))


@cache
def read_partial(tex: str) -> Expression:
    """Read an entry of the table."""
    return read_expression(tex, 0, len(tex))
