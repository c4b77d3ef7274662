"""A bound number that is not printed, told to its author.

Entry point: `mismatch`.

1. Where it is known by which lines the binding held before, what is printed in their place now is
   proposed. Where that is not certain, the nearest number is named, and nothing is proposed: it may
   be another quantity.
2. Else the number is proposed that was most probably meant. It may be written without a look at the
   output only where no other one can be meant.
"""

from __future__ import annotations

from collections.abc import Sequence

from msgspec import Struct

from coursebuild.diagnostics import Diagnostic, Edit, diagnose
from coursebuild.model import NumberBinding
from coursebuild.scripts.nearest import meant, of_window
from coursebuild.scripts.printed import PrintedLine
from coursebuild.scripts.shown import Shown, Window
from coursebuild.scripts.successors import Succession, succession

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
        near = meant(shown, windows).label
        return _Proposal(f"it is not certain what is printed in place of {was} now; {near}", _YOURS)
    written = {of_window(shown, window).rewritten(shown, text) for window in now}
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


def _by_likeness(shown: Shown, text: str, windows: Sequence[Window]) -> _Proposal:
    """What is most probably meant."""
    likeliest = meant(shown, windows)
    better = likeliest.rewritten(shown, text)
    if not better:
        return _Proposal(likeliest.label)
    only = shown.stands_beside(likeliest.window) and all(
        shown.rewritten(text, window) == shown.rewritten(text, likeliest.window)
        for window in windows
    )
    if only:
        return _Proposal(likeliest.label, f"write `{better}`", better)
    return _Proposal(likeliest.label, f"write `{better}`, if that is what is meant")


def _listed(texts: Sequence[str]) -> str:
    named = [*texts[:_NAMED]]
    if len(texts) > _NAMED:
        named.append(f"{len(texts) - _NAMED} more")
    return f"{'; '.join(named[:-1])} and {named[-1]}"
