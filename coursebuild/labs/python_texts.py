"""Texts of lab code as Python: templates, texts put together, and numbers written into them.

Entry points: `joined(parts, used)`, `written(code, used)`, `formatted(method, number, digits,
used)`.

Numbers are written with the very digits that JavaScript writes, by helpers of `python_library`.
"""

from __future__ import annotations

from collections.abc import Sequence

from coursebuild.labs.python_values import (
    CONDITIONAL,
    NAMED,
    NUMBERS,
    OR,
    SUM,
    Code,
    Used,
    floating,
    refuse,
)

METHODS = {
    "toFixed": ("fixed", 0, 100),
    "toPrecision": ("precise", 1, 100),
    "toExponential": ("exponential", 0, 100),
}
"""Of numbers: the helper that does the same, and how many digits may be wanted."""


def joined(parts: Sequence[Code], used: Used) -> Code:
    """Values put together to one text, as in `` `x = ${x}` ``."""
    texts = [written(part, used) for part in parts]
    if len(texts) < 2:
        return texts[0] if texts else Code('""', "str")
    return Code(" + ".join(text.within(SUM) for text in texts), "str", SUM)


def written(code: Code, used: Used) -> Code:
    """A value as JavaScript writes it into a text."""
    if code.type == "str":
        return code
    if code.type == "bool":
        return Code(f'"true" if {code.within(OR)} else "false"', "str", CONDITIONAL)
    if code.type in ("nat", "int"):
        return Code(f"str({code.text})", "str")
    if code.type not in NUMBERS:
        raise refuse(f"{NAMED[code.type]} in a text")
    used.helpers.add("numeral")
    return Code(f"numeral({code.text})", "str")


def formatted(method: str, number: Code, digits: Code | None, used: Used) -> Code:
    """`number.toFixed(digits)` and its like; without `digits` there are none behind the point."""
    helper, least, most = METHODS[method]
    count = "0" if digits is None and method == "toFixed" else "" if digits is None else digits.text
    if not count.isdecimal() or not least <= int(count) <= most:
        raise refuse(f"`.{method}()` other than with a number of digits from {least} to {most}")
    used.helpers.add(helper)
    return Code(f"{helper}({floating(number).text}, {count})", "str")
