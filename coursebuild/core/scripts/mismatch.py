"""The diagnostic of a bound number that is not printed.

Entry point: `mismatch`.

1. Where the lines by which the binding held before are known, it proposes what is printed in their
   place now. A line is the same if it has the same words under the same heading, which is the last
   line above without a number; of several such lines (the rows of a table), if it begins with the
   same number. Where that is not certain, it proposes nothing.
2. Else it names the nearest number, and proposes that if no other number has the same words around
   it: any other may be another quantity.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from decimal import Context, Decimal

from coursebuild.core.model import NumberBinding
from coursebuild.core.scripts.bound_numbers import BoundText, PrintedLine, Window, shows
from coursebuild.core.scripts.lines import canonicalize
from coursebuild.core.scripts.numbers import Number, difference
from coursebuild.core.text.diagnostics import Diagnostic, Edit, diagnose

_QUOTIENT = Context(prec=34)


def mismatch(
    binding: NumberBinding, path: str, lines: Sequence[PrintedLine], before: Sequence[str]
) -> Diagnostic:
    """The diagnostic of a binding that none of these lines bears out.

    `before` are the lines by which it held when it was last checked, if that is known.
    """
    bound_text = BoundText.of(binding.text)
    if not bound_text.numbers:
        return diagnose(
            "binding-mismatch",
            binding.text_span,
            f"`{binding.text}` does not stand in the output of `{path}`",
            help="write it as it is printed, or take `{out}` away",
        )
    label, better = _propose(bound_text, lines, list(map(PrintedLine, before)))
    return diagnose(
        "binding-mismatch",
        binding.text_span,
        f"`{binding.text}` is not what `{path}` printed, rounded to the digits shown",
        label=label,
        help=f"write `{better}`" if better else "",
        edits=[Edit(binding.text_span, better)] if better else [],
    )


def _propose(
    bound_text: BoundText, lines: Sequence[PrintedLine], before: Sequence[PrintedLine]
) -> tuple[str, str]:
    """What is printed instead, in words, and the text to write; empty where that is not certain."""
    windows = bound_text.windows(lines)
    if not windows:
        if len(bound_text.numbers) > 1 and any(line.numbers for line in lines):
            return f"no printed line has {len(bound_text.numbers)} numbers one after the other", ""
        return "no number was printed", ""
    several = len(bound_text.numbers) > 1
    nearest = min(windows, key=lambda window: _distance(bound_text.numbers, window.numbers))
    nearest_text = f"the nearest printed value{'s are' if several else ' is'} {nearest.text}"
    windows_before = [window for window in bound_text.windows(before) if bound_text.shows(window)]
    if not windows_before:
        rewritings = {bound_text.rewrite(window) for window in windows}
        certain = bound_text.has_context(nearest) and len(rewritings) == 1
        return nearest_text, rewritings.pop() if certain else ""
    text_before = windows_before[0].text
    now = [_successor(window, before, lines) for window in windows_before]
    rewritings = {bound_text.rewrite(window) if window else "" for window in now}
    if now[0] is None or len(rewritings) > 1 or ("" in rewritings and len(now) > 1):
        doubt = f"it is not certain what is printed in place of {text_before} now"
        return f"{doubt}; {nearest_text}", ""
    better = rewritings.pop()
    if better and not BoundText.of(better).is_in(lines):  # other numbers have its words or unit
        better = ""
    are, were = ("are", "were") if several else ("is", "was")
    return f"{now[0].text} {are} printed where {text_before} {were}", better


def _successor(
    window_before: Window, before: Sequence[PrintedLine], now: Sequence[PrintedLine]
) -> Window | None:
    """What is printed now where numbers were printed before; `None` where that is not certain."""
    index = next(i for i, line in enumerate(before) if line is window_before.line)
    old, new = _line_keys(before), _line_keys(now)
    first = window_before.line.numbers.index(window_before.numbers[0])
    for keys_before, keys_now in zip(old, new, strict=True):
        key = keys_before[index]
        if keys_before.count(key) == keys_now.count(key) == 1:
            line = now[keys_now.index(key)]
            return Window(line, line.numbers[first : first + len(window_before.numbers)])
    return None


def _line_keys(lines: Sequence[PrintedLine]) -> tuple[list[Hashable], list[Hashable]]:
    """Two keys of each line: its heading and words; these and the number that it begins with.

    The number counts only in lines with several.
    """
    heading = ""
    words: list[Hashable] = []
    rows: list[Hashable] = []
    for line in lines:
        skeleton = canonicalize(line.text).skeleton.strip()
        if not line.numbers and any(map(str.isalpha, skeleton)):
            heading = skeleton
        words.append((heading, skeleton))
        label = line.numbers[0].value if len(line.numbers) > 1 else None
        rows.append((heading, skeleton, label))
    return words, rows


def _distance(
    bound_numbers: Sequence[Number], printed: Sequence[Number]
) -> tuple[Decimal, Decimal]:
    """The distance of printed numbers from bound ones: relative to their sizes, and absolute."""
    relative = absolute = Decimal()
    for s, p in zip(bound_numbers, printed, strict=True):
        if shows(s, p):
            continue
        if not (s.is_finite and p.is_finite):
            return Decimal("Infinity"), absolute
        shown_size, printed_size = s.value.copy_abs(), p.value.copy_abs()
        relative += _QUOTIENT.divide(
            difference(shown_size, printed_size), max(shown_size, printed_size)
        )
        absolute += difference(s.value, p.value)
    return relative, absolute
