"""A bound number that is not printed, told to its author.

Entry point: `mismatch`.

1. Where it is known by which lines the binding held before, what is printed in their place now is
   proposed. A line is the same if it has the same words under the same heading, the last line above
   without a number; of several such lines, which are the rows of a table, if it begins with the
   same number. Where that is not certain, nothing is proposed.
2. Else the nearest number is named. It is proposed where no other one stands beside the same words,
   since any other may be another quantity.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from decimal import Context, Decimal

from coursebuild.core.model import NumberBinding
from coursebuild.core.scripts.bound_numbers import PrintedLine, Shown, Window, shows
from coursebuild.core.scripts.lines import canonical
from coursebuild.core.scripts.numbers import Number, difference
from coursebuild.core.text.diagnostics import Diagnostic, Edit, diagnose

_QUOTIENT = Context(prec=34)


def mismatch(
    binding: NumberBinding, path: str, lines: Sequence[PrintedLine], before: Sequence[str]
) -> Diagnostic:
    """What is wrong with a binding that none of some lines bears out.

    `before` are the lines by which it held when it was last looked at, if that is known.
    """
    shown = Shown.of(binding.text)
    if not shown.numbers:
        return diagnose(
            "binding-mismatch",
            binding.text_span,
            f"`{binding.text}` does not stand in the output of `{path}`",
            help="write it as it is printed, or take `{out}` away",
        )
    label, better = _proposal(shown, binding.text, lines, list(map(PrintedLine, before)))
    return diagnose(
        "binding-mismatch",
        binding.text_span,
        f"`{binding.text}` is not what `{path}` printed, rounded to the digits shown",
        label=label,
        help=f"write `{better}`" if better else "",
        edits=[Edit(binding.text_span, better)] if better else [],
    )


def _proposal(
    shown: Shown, text: str, lines: Sequence[PrintedLine], before: Sequence[PrintedLine]
) -> tuple[str, str]:
    """What is printed instead, in words, and the text to write; empty where that is not certain."""
    windows = shown.windows(lines)
    if not windows:
        if len(shown.numbers) > 1 and any(line.numbers for line in lines):
            return f"no printed line has {len(shown.numbers)} numbers one after the other", ""
        return "no number was printed", ""
    several = len(shown.numbers) > 1
    nearest = min(windows, key=lambda window: _distance(shown.numbers, window.numbers))
    near = f"the nearest printed value{'s are' if several else ' is'} {nearest.text}"
    places = [window for window in shown.windows(before) if shown.shows(window)]
    if not places:
        written = {_rewritten(shown, text, window) for window in windows}
        certain = shown.stands_beside(nearest) and len(written) == 1
        return near, written.pop() if certain else ""
    was, now = places[0].text, [_successor(place, before, lines) for place in places]
    written = {_rewritten(shown, text, window) if window else "" for window in now}
    if now[0] is None or len(written) > 1 or ("" in written and len(now) > 1):
        return f"it is not certain what is printed in place of {was} now; {near}", ""
    better = written.pop()
    if better and not Shown.of(better).is_in(lines):  # its words or its unit stand beside others
        better = ""
    are, were = ("are", "were") if several else ("is", "was")
    return f"{now[0].text} {are} printed where {was} {were}", better


def _successor(
    place: Window, before: Sequence[PrintedLine], now: Sequence[PrintedLine]
) -> Window | None:
    """What is printed now where numbers were printed before; `None` where that is not certain."""
    index = next(i for i, line in enumerate(before) if line is place.line)
    old, new = _known_by(before), _known_by(now)
    first = place.line.numbers.index(place.numbers[0])
    for keys_before, keys_now in zip(old, new, strict=True):
        key = keys_before[index]
        if keys_before.count(key) == keys_now.count(key) == 1:
            line = now[keys_now.index(key)]
            return Window(line, line.numbers[first : first + len(place.numbers)])
    return None


def _known_by(lines: Sequence[PrintedLine]) -> tuple[list[Hashable], list[Hashable]]:
    """What each line is known by: its heading and words; these and the number that it begins with.

    A line with one number begins with none.
    """
    heading = ""
    words: list[Hashable] = []
    rows: list[Hashable] = []
    for line in lines:
        skeleton = canonical(line.text).skeleton.strip()
        if not line.numbers and any(map(str.isalpha, skeleton)):
            heading = skeleton
        words.append((heading, skeleton))
        label = line.numbers[0].value if len(line.numbers) > 1 else None
        rows.append((heading, skeleton, label))
    return words, rows


def _distance(shown: Sequence[Number], printed: Sequence[Number]) -> tuple[Decimal, Decimal]:
    """How far printed numbers are from those shown: relatively by their sizes, then absolutely."""
    far = gap = Decimal()
    for s, p in zip(shown, printed, strict=True):
        if shows(s, p):
            continue
        if not (s.finite and p.finite):
            return Decimal("Infinity"), gap
        one, other = s.value.copy_abs(), p.value.copy_abs()
        far += _QUOTIENT.divide(difference(one, other), max(one, other))
        gap += difference(s.value, p.value)
    return far, gap


def _rewritten(shown: Shown, text: str, window: Window) -> str:
    """The binding's text with printed numbers in it; empty where nothing of one would be left."""
    better = shown.rewritten(text, window) or ""
    new = Shown.of(better).numbers if better else ()
    lost = any(p.value and not n.value for n, p in zip(new, window.numbers, strict=False))
    return "" if lost else better
