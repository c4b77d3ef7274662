"""Where the time goes, in words and as a table."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from mjbench.reports.scene_report import PhaseProfile
from mjbench.reports.shown_errors import seconds_text
from mjbench.reports.terminal import Style, fitted_table

_ALIKE = math.log(1.1)
"""Times that differ by less are alike: the wall clock tells no more."""


def profile_text(
    own_profile: PhaseProfile, rival: PhaseProfile | None, *, is_alike: bool = False
) -> str:
    """What of the time a verdict rests on that compares two settings.

    Without a `rival` only what takes the longest is known. `is_alike`: whether the costs of both
    scenarios are no more apart than timing can tell.
    """
    phases = [name for name in own_profile.phases if name != "other"]
    phase = max(phases, key=lambda name: own_profile.phases[name])
    share = own_profile.phases[phase] / own_profile.step if own_profile.step else 0.0
    most = f"of the phases {phase} takes the most, {100 * share:.0f} % of a step"
    if rival is None:
        return most
    pairs = {
        name: (own_profile.steps * time, rival.steps * rival.phases.get(name, 0.0))
        for name, time in own_profile.phases.items()
    }
    before, after = (sum(times) for times in zip(*pairs.values(), strict=True))
    if is_alike or not (before and after) or abs(math.log(after / before)) < _ALIKE:
        return f"{most}; the verdict rests on errors, not on time"
    sign = math.copysign(1.0, after - before)
    phase = max(pairs, key=lambda name: sign * (pairs[name][1] - pairs[name][0]))
    change = " → ".join(map(_text, pairs[phase]))
    return f"{most}; the verdict rests on {phase}: over the scenario {change} under {rival.name}"


def _text(seconds: float) -> str:
    return seconds_text(seconds, 2)


def profile_lines(profiles: Sequence[PhaseProfile], text: str, style: Style) -> Iterator[str]:
    """A table of phases by setting, and what the verdict rests on."""
    if not profiles:
        return
    yield ""
    yield from style.wrap(f"where the time goes: {text}")
    names = list(profiles[0].phases)
    labels = ("a step", *names, "steps", "contacts", "rows of constraints", "iterations", "islands")
    columns: list[tuple[str, list[str]]] = [("", list(labels))]
    for profile in profiles:
        times = [_share(profile, name) for name in names]
        counts = [f"{profile.steps}", _counts(profile.contacts), _counts(profile.constraints)]
        means = [f"{profile.iterations:.3g}", f"{profile.islands:.3g}"]
        columns.append((profile.name, [_text(profile.step), *times, *counts, *means]))
    yield from fitted_table(columns, style.width)
    rounds = min(profile.rounds for profile in profiles)
    yield from style.wrap(
        f"by MuJoCo's own timers, the quickest of {rounds} rounds; contacts, rows, iterations and "
        "islands are means of all steps, and the most in brackets"
    )


def _share(profile: PhaseProfile, name: str) -> str:
    time = profile.phases.get(name)
    if time is None:
        return ""
    share = f"{100 * time / profile.step:.0f} %" if profile.step else ""
    return f"{_text(time)}  {share}".rstrip()


def _counts(counts: tuple[float, int]) -> str:
    return f"{counts[0]:.3g} ({counts[1]})"
