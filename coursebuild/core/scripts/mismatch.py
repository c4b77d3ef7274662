"""A bound number that is not printed, told to its author.

Entry point: `mismatch`.

1. Where it is known by which lines the binding held before, what is printed in their place now is
   proposed. Where that is not certain, the nearest number is named, and nothing is proposed: it may
   be another quantity.
2. Else the number is proposed that was most probably meant: the same but for the sign, else the
   relatively nearest, where another sign or another power of ten counts as a second mistake. It may
   be written without a look at the output only where no other one can be meant.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from decimal import Context, Decimal

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.model import NumberBinding
from coursebuild.core.scripts.bound_numbers import PrintedLine, Shown, Window, shows
from coursebuild.core.scripts.numbers import Number, difference, unit, within_half_unit
from coursebuild.core.scripts.successors import Succession, succession
from coursebuild.core.text.diagnostics import Diagnostic, Edit, diagnose

_SECOND_MISTAKE = 10
"""How many times as far away a number counts that needs another mistake beside its digits."""
_QUOTIENT = Context(prec=34)
_EXACT = Context(prec=40_000)
_NAMED = 4
"""Numbers of which one may be meant that are named."""
_YOURS = "write the number that the sentence is about"


class _Proposal(Struct, frozen=True):
    label: str
    help: str = ""
    better: str = ""
    """The text to write; empty where that is not certain."""


def mismatch(
    binding: NumberBinding,
    path: str,
    lines: Sequence[PrintedLine],
    before: tuple[str, ...],
    now: Sequence[PrintedLine],
) -> Diagnostic:
    """What is wrong with a binding that none of some lines bears out.

    `before` are the lines by which it held when it was last looked at, if that is known, and `now`
    those that take their place.
    """
    shown = Shown.of(binding.text)
    if not shown.numbers:
        return diagnose(
            "binding-mismatch",
            binding.text_span,
            f"`{binding.text}` does not stand in the output of `{path}`",
            help="write it as it is printed, or take `{out}` away",
        )
    windows = shown.windows(lines)
    if windows:
        found = succession(shown, before, now) if before else Succession((), ())
        said = _by_place(shown, binding.text, found, windows, lines) or _by_likeness(
            shown, binding.text, windows
        )
    elif len(shown.numbers) > 1 and any(line.numbers for line in lines):
        said = _Proposal(f"no printed line has {len(shown.numbers)} numbers one after the other")
    else:
        said = _Proposal("no number was printed")
    return diagnose(
        "binding-mismatch",
        binding.text_span,
        f"`{binding.text}` is not what `{path}` printed, rounded to the digits shown",
        label=said.label,
        help=said.help,
        edits=[Edit(binding.text_span, said.better)] if said.better else [],
    )


# --- by place


def _by_place(
    shown: Shown,
    text: str,
    found: Succession,
    windows: Sequence[Window],
    lines: Sequence[PrintedLine],
) -> _Proposal | None:
    """What is printed where the numbers were; `None` where nobody knows where that was."""
    if not found.before:
        return None
    was = found.before[0].text
    now = [window for window in found.now if window is not None]
    if len(now) < len(found.now):
        near = _label(shown, _likeliest(shown, windows))
        return _Proposal(f"it is not certain what is printed in place of {was} now; {near}", _YOURS)
    written = {_rewritten(shown, text, window) for window in now}
    different = list(dict.fromkeys(window.text for window in now))
    if len(written) > 1 or ("" in written and len(different) > 1):
        places = f"it was printed in {len(now)} places"
        return _Proposal(f"{places}, where now {_listed(different)} are printed", _YOURS)
    (better,) = written
    if better and not Shown.of(better).is_in(lines):  # its words or its unit stand beside others
        better = ""
    are, were = ("are", "were") if len(shown.numbers) > 1 else ("is", "was")
    label = f"{different[0]} {are} printed where {was} {were}"
    return _Proposal(label, f"write `{better}`" if better else "", better)


def _listed(texts: Sequence[str]) -> str:
    named = [*texts[:_NAMED]]
    if len(texts) > _NAMED:
        named.append(f"{len(texts) - _NAMED} more")
    return f"{'; '.join(named[:-1])} and {named[-1]}"


# --- by likeness


def _by_likeness(shown: Shown, text: str, windows: Sequence[Window]) -> _Proposal:
    """What is most probably meant."""
    likeliest = _likeliest(shown, windows)
    label = _label(shown, likeliest)
    better = _rewritten(shown, text, likeliest)
    if not better:
        return _Proposal(label)
    others = {shown.rewritten(text, window) for window in windows}
    if shown.stands_beside(likeliest) and others == {better}:
        return _Proposal(label, f"write `{better}`", better)
    return _Proposal(label, f"write `{better}`, if that is what is meant")


def _likeliest(shown: Shown, windows: Sequence[Window]) -> Window:
    """The likeliest of some printed numbers, at least one; the first of those alike."""

    def unlikeness(window: Window) -> tuple[bool, Decimal, Decimal]:
        pairs = list(zip(shown.numbers, window.numbers, strict=True))
        far, gap = sum((_far(*p) for p in pairs), Decimal()), sum(map(_gap, pairs), Decimal())
        return not _all(shown, window, _same_size), far, gap

    return min(windows, key=unlikeness)


def _all(shown: Shown, window: Window, same: Callable[[Number, Number], bool]) -> bool:
    return all(map(same, shown.numbers, window.numbers))


def _label(shown: Shown, window: Window) -> str:
    """In what printed numbers are not those of a binding, in words."""
    several = len(window.numbers) > 1
    if _all(shown, window, _same_size):
        what = "same numbers are printed with other signs"
        one = "same number is printed with the other sign"
    elif _all(shown, window, _same_digits):
        what = one = "same digits are printed with another power of ten"
    else:
        return f"the nearest printed value{'s are' if several else ' is'} {window.text}"
    return f"the {what if several else one}: {window.text}"


def _rewritten(shown: Shown, text: str, window: Window) -> str:
    """The binding's text with printed numbers in it; empty where digits would be lost."""
    better = shown.rewritten(text, window) or ""
    new = Shown.of(better).numbers if better else ()
    if any(p.value and not n.value for n, p in zip(new, window.numbers, strict=False)):
        return ""
    scaled = _all(shown, window, _same_digits) and not _all(shown, window, _same_size)
    if scaled and any(_digits(n) < _digits(o) for n, o in zip(new, shown.numbers, strict=False)):
        return ""
    return better


def _far(shown: Number, printed: Number) -> Decimal:
    """How unlikely a printed number is meant: 0 if it is shown, about 1 if it is another."""
    if shows(shown, printed):
        return Decimal(0)
    if not (shown.finite and printed.finite):
        return Decimal("Infinity")
    one, other = shown.value.copy_abs(), printed.value.copy_abs()
    far = _QUOTIENT.divide(difference(one, other), max(one, other))
    if _same_digits(shown, printed):
        by_chance = _QUOTIENT.divide(unit(shown.place), _EXACT.add(one, one))
        far = min(far, _SECOND_MISTAKE * by_chance)
    turned = shown.value.is_signed() != printed.value.is_signed() and one and other
    return far * _SECOND_MISTAKE if turned else far


def _gap(pair: tuple[Number, Number]) -> Decimal:
    shown, printed = pair
    finite = shown.finite and printed.finite
    return difference(shown.value, printed.value) if finite else Decimal(0)


def _same_size(shown: Number, printed: Number) -> bool:
    """Whether they are the same but for the sign."""
    return shows(_unsigned(shown), _unsigned(printed))


def _same_digits(shown: Number, printed: Number) -> bool:
    """Whether they are the same but for the sign and a power of ten."""
    if _same_size(shown, printed):
        return True
    if not (shown.finite and printed.finite and shown.value and printed.value):
        return False
    shift = shown.value.adjusted() - printed.value.adjusted()
    scaled = printed.value.copy_abs().scaleb(shift, _EXACT)
    return within_half_unit(_unsigned(shown), scaled)


def _unsigned(number: Number) -> Number:
    return replace(number, value=number.value.copy_abs())


def _digits(number: Number) -> int:
    """Significant digits as written."""
    return number.value.adjusted() - number.place + 1 if number.value else 0
