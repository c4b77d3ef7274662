"""The verdict on a scene's own setting, from a report on it.

1. Only an error that falls as more work is done says what a setting does: one that is smaller than
   that of a shorter timestep, or of more iterations, is luck, and so is one beyond the largest
   stable timestep.
2. Another setting is better where it costs less, or errs less, and no column is worse: over the
   whole run and over its halves, from starts nearby too. Where that is not so, or is not known, the
   sentence says in which.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import TypeAlias

from msgspec.structs import replace

from mjbench.columns import (
    WHOLE,
    Column,
    Spread,
    columns_of,
    leasts_of,
    number_text,
    rounded_text,
    row_ratios,
    spreads,
    times_text,
    worse_texts,
)
from mjbench.reports.limits import stability_text, stray_timestep
from mjbench.reports.scene_report import (
    ErrorParts,
    ErrorQuantity,
    RowVerdict,
    ScenarioReport,
    WorkPrecisionRow,
)
from mjbench.reports.shown_errors import (
    ERROR_SLACK,
    SEEN,
    STEPPED,
    Rows,
    horizon_error_text,
    is_cheaper,
    seconds_text,
    setting_text,
)

Starts: TypeAlias = Callable[[int], Sequence[Mapping[Column, float]] | None]
"""The number of a row → how many times as large its errors are as the own setting's, from starts
nearby; `None` where that was not measured."""
_WORTH_SAYING = 0.1
"""An advantage that is smaller in both respects is none on another day."""
_NEGLIGIBLE = 0.01
"""The share of the scene's own error below which others may rise, as those of rounding do."""


def mark_luck(
    rows: Rows, limits: Mapping[str, float], quantity: ErrorQuantity
) -> tuple[WorkPrecisionRow, ...]:
    """Rows that say where their errors are luck.

    `limits`: the largest stable timesteps (s) under the scene's own solver, by integrator.
    """
    own_row = next(row for row in rows if row.own)
    least = max(quantity.least, _NEGLIGIBLE * (quantity.value_of(own_row) or 0.0))
    slack = 1 + ERROR_SLACK
    marked_rows = []
    for row in rows:
        setting, place = row.setting, quantity.value_of(row)
        limit = limits.get(setting.integrator, math.inf)
        luck, is_usual = "", setting.solver_settings == own_row.setting.solver_settings
        if place is not None and is_usual and setting.timestep > limit * (1 + 1e-9):
            luck = "the shortest timestep that was tried is lost"
            if limit:
                luck = f"it is beyond its largest stable timestep, {seconds_text(limit, 3)}"
        for rival in rows:
            dear, error, work = rival.setting, quantity.value_of(rival), ""
            if dear == replace(setting, timestep=dear.timestep):
                work = "shorter timesteps" if dear.timestep < setting.timestep else ""
            elif dear == replace(setting, iterations=dear.iterations):
                work = "more iterations" if dear.iterations > setting.iterations else ""
            if luck or not work or row.status != "ok":
                continue
            known_until = math.inf if row.parted is None else (1 - _WORTH_SAYING) * row.parted
            if rival.parted is not None and rival.parted < known_until:
                luck = f"with {work} it is off sooner"
            elif place is not None and error is not None and error > max(place * slack, least):
                luck = f"its error rises with {work}"
        marked_rows.append(replace(row, lucky=luck))
    return tuple(marked_rows)


def judge_setting(report: ScenarioReport, starts: Starts) -> RowVerdict:
    """The verdict on the scene's own setting, whose rows say what dominates them."""
    quantity, rows = quantity_of(report), report.rows
    own_index = next(number for number, row in enumerate(rows) if row.own)
    row = rows[own_index]
    if row.reasons:
        return _verdict_of_lost(rows, row, quantity)
    remark = _describe_error(report, row)
    if row.parted is not None:
        text = _verdict_of_chaos(rows, row, horizon_error_text(report.horizon_error))
        return RowVerdict(None, text)
    if not any(map(quantity.value_of, rows)):
        text = "no setting can be called better: none errs, as where nothing moves"
        return RowVerdict(None, text)
    if row.cost is None or quantity.value_of(row) is None:
        text = "nothing was timed, so no setting can be called better"
        return RowVerdict(None, text + remark)
    if row.dominated_by is None and row.lucky:
        text = f"nothing can be said of the scene's own setting: {row.lucky}"
        return RowVerdict(None, text + remark)
    if row.dominated_by is None:
        return RowVerdict(None, _describe_rival(report) + remark)
    text, is_better = _judge_rival(report, row.dominated_by, starts)
    return RowVerdict(row.dominated_by if is_better else None, text + remark)


def quantity_of(report: ScenarioReport) -> ErrorQuantity:
    """The error that settings are compared by first."""
    matches = (quantity for quantity in report.quantities if quantity.name == report.main)
    return next(matches, replace(SEEN, least=report.least_seen))


def _judge_rival(report: ScenarioReport, number: int, starts: Starts) -> tuple[str, bool]:
    """What is said of a row that is better here, and whether it is better."""
    baseline, rival = next(r for r in report.rows if r.own), report.rows[number]
    figure, none = report.figure, "no difference that holds: "
    own_ratios = _ratios(report, baseline, rival)
    pair = [columns_of(row, report.contact_model) for row in (baseline, rival)]
    leasts = leasts_of(report)
    resolved = [c for c in own_ratios if max(pair[0][c], pair[1][c]) > leasts[c[0]] * (1 + 1e-9)]
    if not resolved and (baseline.seen is None or report.least_seen >= 1):
        text = "no setting can be called better: the reference resolves no error of "
        return f"{text}{rival.name}, or of the scene's own setting", False
    quantity = quantity_of(report)
    if quantity.name == "seen" and rival.step_error is not None:
        quantity = replace(STEPPED, least=report.least_seen)
    value = quantity.value_of(rival)
    is_vague = not resolved or (value is not None and value <= quantity.least)

    def gain(starts: Sequence[Mapping[Column, float]]) -> str:
        text = _gain_text(starts, figure, is_least=is_vague)
        return text + (_AS_FAR if is_vague and " less" not in text else "")

    if not _is_notable(min(own_ratios.values()), rival):
        return _describe_rival(report), False
    price = _price(rival)
    claim = f"{rival.name} {price} and {gain([own_ratios])}"
    nearby, elsewhere = starts(number), "from starts nearby"
    elsewhere += " or with drawn parameters" if report.drawn else ""
    if nearby is None:
        return f"{claim} here; whether that holds {elsewhere} was not measured", False
    everywhere = [own_ratios, *nearby]
    if worse := worse_texts(report, baseline, everywhere):
        return f"{none}{claim} here, but {elsewhere} {worse[0]}", False
    if not _is_notable(_gain(everywhere).high, rival):
        return f"{none}{claim} here, but is no better {elsewhere}", False
    if limit := stray_timestep(report, rival):
        reason = f"leaves the motion of small steps at some timesteps beyond {limit}"
        return f"{none}{claim} here, but {rival.setting.integrator} {reason}", False
    return f"{rival.name} is better: it {price} and {gain(everywhere)}", True


_AS_FAR = ", as far as the reference resolves"


def _ratios(
    report: ScenarioReport, baseline: WorkPrecisionRow, rival: WorkPrecisionRow
) -> dict[Column, float]:
    """How many times as large the errors of a rival are as the own ones, where they may differ."""
    ratios = row_ratios(report, baseline, rival)
    if baseline.setting.cone == rival.setting.cone:  # the model errs alike under both
        ratios.pop(("contact_model", WHOLE), None)
    return ratios


def _is_notable(ratio: float, rival: WorkPrecisionRow) -> bool:
    """Whether a rival costs so much less, or has such a part of an error, that it is worth saying.

    What is no more is within what such runs differ by.
    """
    most, cost = 1 - _WORTH_SAYING, rival.cost
    return ratio <= most or (cost is not None and cost.value <= most and cost.high < 1)


def _gain(starts: Sequence[Mapping[Column, float]]) -> Spread:
    """The column in which an error is smallest, relative to the other one, from all starts."""
    matches = [spread for spread in spreads(starts) if math.isfinite(spread.high)]
    none = Spread(("", ""), 1.0, 1.0)
    return min(matches, key=lambda part: (part.high, part.column[1] != WHOLE), default=none)


def _gain_text(
    starts: Sequence[Mapping[Column, float]], figure: str, *, is_least: bool = False
) -> str:
    """How much less a setting errs in the column where it errs least, from all starts.

    `is_least`: so much at least.
    """
    gain = _gain(starts)
    if gain.high >= 1 / (1 + ERROR_SLACK):
        return "errs no more in any column"
    if gain.high < 1e-4:
        return "errs far less"
    less = times_text(1 / gain.high, math.inf if is_least else 1 / max(gain.low, 1e-300))
    return f"errs {less} less ({gain.label(figure)} {gain.column[1]})"


def _price(row: WorkPrecisionRow) -> str:
    """What a setting costs beside the scene's own, as far as timing can tell."""
    cost = row.cost
    if cost is None or cost.low <= 1 <= cost.high or abs(cost.value - 1) < 0.05:  # two digits: 1
        return "takes about as long"
    return f"takes {number_text(cost.value)} {'of the time' if cost.value < 1 else 'times as long'}"


def _describe_rival(report: ScenarioReport) -> str:
    """The cheapest setting that would be better by one number, and why it is not."""
    row, baseline = _cheapest_rival(report), report.own_row
    if row is None or baseline is None:
        return "no other setting that was measured is cheaper without being less accurate"
    own_ratios = row_ratios(report, baseline, row)
    worse = worse_texts(report, baseline, [own_ratios])
    if row.lucky or not worse:
        gain = f"{_price(row)} and {_gain_text([own_ratios], report.figure)}"
        reason = row.lucky or "that is within what such runs differ by"
        return f"no difference that holds: {row.name} {gain} here, but {reason}"
    return f"no setting is better: {row.name} {_price(row)}, but {worse[0]}"


def _cheapest_rival(report: ScenarioReport) -> WorkPrecisionRow | None:
    """The cheapest setting that costs less and errs no more, by the error compared first."""
    baseline, quantity = report.own_row, quantity_of(report)
    error = None if baseline is None else quantity.value_of(baseline)
    if baseline is None or (own_cost := baseline.cost) is None or error is None:
        return None
    rivals = [
        (cost.value, number)
        for number, row in enumerate(report.rows)
        if row.status == "ok" and (cost := row.cost) is not None and is_cheaper(cost, own_cost)
        if (value := quantity.value_of(row)) is not None and value <= error * (1 + ERROR_SLACK)
    ]
    return report.rows[min(rivals)[1]] if rivals else None


def rival_row(report: ScenarioReport) -> WorkPrecisionRow | None:
    """The setting that a verdict compares with the own one; `None` where there is none."""
    baseline = report.own_row
    if baseline is None or baseline.status != "ok" or baseline.parted is not None:
        return None
    number = baseline.dominated_by
    row = None if number is None else report.rows[number]
    if row is not None and _is_notable(min(_ratios(report, baseline, row).values()), row):
        return row
    return _cheapest_rival(report)


def compared_rows(report: ScenarioReport) -> dict[int, WorkPrecisionRow]:
    """The rows that a verdict speaks of, by number: the own one, its rival, what mends its error.

    None where the own setting is lost.
    """
    baseline = report.own_row
    if baseline is None or baseline.status != "ok":
        return {}
    rows = [baseline, rival_row(report)]
    if report.parts is not None and report.parts.dominant:
        rows.append(_mending_row(report, baseline, report.parts.dominant))
    numbers = [next(n for n, r in enumerate(report.rows) if r is row) for row in rows if row]
    return {number: report.rows[number] for number in dict.fromkeys(numbers)}


def _verdict_of_chaos(rows: Rows, row: WorkPrecisionRow, error: str) -> str:
    text = f"the motion is chaotic: off by {error} at {row.parted:.3g} s"
    usable = [r for r in rows if r.status == "ok" and not r.lucky]
    whole = [r for r in usable if r.parted is None and r.seen is not None]
    if whole:
        cheapest = min(whole, key=lambda r: r.cost.value if r.cost else float(r.evaluations))
        return f"{text}; under {setting_text(cheapest.setting)} not before the horizon"
    best = max(usable, key=lambda r: r.parted or 0.0, default=row)
    if (best.parted or 0.0) > (row.parted or 0.0):
        text += f", under {setting_text(best.setting)} at {best.parted:.3g} s"
    return text


def _verdict_of_lost(rows: Rows, row: WorkPrecisionRow, quantity: ErrorQuantity) -> RowVerdict:
    text = f"the scene does not run under its own setting, {setting_text(row.setting)}: "
    text += "; ".join(row.reasons)
    candidates = [
        (error, row.cost.value, number)
        for number, row in enumerate(rows)
        if row.front and row.cost is not None and (error := quantity.value_of(row)) is not None
    ]
    if not candidates:
        return RowVerdict(None, text)
    error, _, better = min(candidates)
    text += f"; {setting_text(rows[better].setting)} is the most accurate that does"
    text += _AS_FAR if error <= quantity.least else ""
    return RowVerdict(better, text)


def _describe_error(report: ScenarioReport, own_row: WorkPrecisionRow) -> str:
    """Whether the own error is seen."""
    error, least = own_row.seen, report.least_seen
    if error is None or max(1.0, error) <= least:
        return "; whether the scene's own error can be seen is not known"
    if not error:
        return "; the scene's own setting makes no error"
    if error < 1:
        size = f"{'less than ' if error <= least else ''}{error:.2g}"
        return f"; the scene's own error cannot be seen: it is {size} of what an eye can tell"
    times = number_text(error)
    return f"; the scene's own error can be seen: it is {times} times what an eye can tell"


def five_lines(report: ScenarioReport) -> tuple[str, ...]:
    """The verdict in at most five lines: speed, error, what is better, stability, what is missing.

    The report has its verdict already.
    """
    row, failures = report.own_row, dict[str, list[str]]()
    for failure in report.failures:
        part = failure.part.removeprefix(f"{report.name}: ")
        failures.setdefault(failure.reason, []).append(part)
    missing = [f"{', '.join(names)}: {reason}" for reason, names in failures.items()]
    if row is None:
        missing.insert(0, "the scene's own setting was not measured")
        return (f"not known: {'; '.join(missing)}",)
    quantity = quantity_of(report)
    pace = None if row.realtime is None else f"{rounded_text(row.realtime, 3)} times real time"
    speed = f"{setting_text(row.setting)}: {pace or 'not timed'}"
    if report.overlaps:
        speed += f"; it begins with one inside the other: {report.overlaps}"
    error = "its error is not known" if row.parted is None else ""  # chaos is told by the verdict
    if row.status != "ok":
        error = "it is lost"
    elif (value := quantity.value_of(row)) == 0:
        error = "it makes no error"
    elif value is not None:
        is_known = value > quantity.least * (1 + 1e-9)
        error = f"errs by {'' if is_known else 'less than '}{rounded_text(value, 2)}"
        error += f" in {quantity.label}"
        if quantity.name == "step_error" and row.seen is not None and row.seen > value:
            error += f", and by at most {rounded_text(row.seen, 2)} with the model of contacts"
        error += parts_text(report.parts)
    better, *_ = report.verdict.text.split("; the scene's own error")
    lines = [speed, error, better, stability_text(report)]
    if report.horizon < report.duration * (1 - 1e-9):
        missing.append(f"the motion beyond {seconds_text(report.horizon, 3)}")
    is_told = any("errors apart" in names for names in failures.values())
    if report.parts is None and row.parted is None and row.status == "ok" and not is_told:
        missing.append("the error was not taken apart")
    if missing:
        lines.append("not known: " + "; ".join(missing))
    return tuple(filter(None, lines))


def parts_text(parts: ErrorParts | None) -> str:
    """Which part of the error dominates, and what mends it."""
    if parts is None or not parts.dominant:
        return ""
    name = {
        "timestep": "the timestep's",
        "solver": "the solver's",
        "contact_model": "the model of contacts'",
        "rounding": "rounding's",
    }[parts.dominant]
    return f"; most of it is {name}" + (f": {parts.mend}" if parts.mend else "")


def find_parts(report: ScenarioReport, parts: ErrorParts) -> ErrorParts:
    """The same with what dominates, and the cheapest measured setting that halves it."""
    names = ("timestep", "solver", "contact_model", "rounding")
    sizes = {n: value for n in names if (value := getattr(parts, n)) is not None}
    name = max(sizes, key=lambda n: sizes[n], default="")
    baseline = report.own_row
    if not name or sizes[name] <= parts.least * (1 + 1e-9) or baseline is None:
        return parts
    if baseline.lucky or baseline.seen is None or baseline.seen <= parts.least * (1 + 1e-9):
        return parts  # nobody knows of what most of it is
    return replace(parts, dominant=name, mend=_mend(report, baseline, name))


def _mend(report: ScenarioReport, baseline: WorkPrecisionRow, name: str) -> str:
    row = _mending_row(report, baseline, name)
    if row is None or row.seen is None or baseline.seen is None:
        return ""
    ratio = baseline.seen / row.seen if row.seen else math.inf
    is_least = row.seen <= report.least_seen * (1 + 1e-9)
    times = times_text(ratio, math.inf if is_least else ratio)
    text = f"{row.name} errs {times} less in all"
    text += "" if row.cost is None else f" and {_price(row)}"
    worse = worse_texts(report, baseline, [row_ratios(report, baseline, row)])
    return f"{text}, but {worse[0]}" if worse else text


def _mending_row(
    report: ScenarioReport, baseline: WorkPrecisionRow, name: str
) -> WorkPrecisionRow | None:
    """The cheapest setting that halves the error by what is called `name`; `None` if none does."""

    def halves(row: WorkPrecisionRow) -> bool:
        setting, mine = row.setting, baseline.setting
        alike = setting.integrator == mine.integrator and setting.timestep == mine.timestep
        is_kind = {
            "timestep": setting.solver_settings == mine.solver_settings,
            "solver": alike and setting.cone == mine.cone and not row.own,
            "contact_model": alike and setting.cone != mine.cone,
        }.get(name, False)
        return is_kind and row.seen is not None and 2 * row.seen <= (baseline.seen or 0.0)

    matches = [row for row in report.rows if row.status == "ok" and not row.lucky and halves(row)]
    return min(matches, key=lambda r: r.cost.value if r.cost else math.inf, default=None)
