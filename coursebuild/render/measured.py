"""What was measured on a model, as its page shows it.

Entry point: `measured_view(library, place, name)`. What was not measured is said to be so, with the
command that measures it.
"""

from __future__ import annotations

from markupsafe import Markup, escape

from coursebuild.measured.bench import (
    OrderRow,
    ScenarioReport,
    SceneReport,
    StableRow,
    WorkPrecisionRow,
)
from coursebuild.measured.diet import DietReport, Finding, Saving
from coursebuild.measured.points import (
    Quantity,
    quantities,
    seconds_text,
    setting_text,
    solving_parts,
    status_text,
    usual_setting,
)
from coursebuild.measured.records import bench_path, diet_path
from coursebuild.model import MjcfModel
from coursebuild.render import urls
from coursebuild.render.figures import (
    Grid,
    again,
    bounded,
    factor,
    grid,
    percent,
    power,
    said,
    sentence,
    size,
    where,
    whole,
)
from coursebuild.render.library import Library
from coursebuild.render.strings import Strings
from coursebuild.values import dataclass

_QUANTITIES = {
    "seen": "measured.seen",
    "position": "measured.position",
    "attitude": "measured.attitude",
    "velocity": "measured.velocity",
}
ORDERS = (
    ("position", "measured.order_position"),
    ("attitude", "measured.order_attitude"),
    ("velocity", "measured.order_velocity"),
)
"""Orders that are fitted, with their titles."""


@dataclass(frozen=True, slots=True)
class ScenarioView:
    """A scenario."""

    name: str
    title: str
    about: tuple[str, ...]
    """How long it takes and what it was held against, a sentence each."""
    verdict: str
    settings: Grid
    notes: tuple[str, ...]
    """Of runs that say nothing, or of another model."""
    orders: Grid | None
    stable: Grid | None


@dataclass(frozen=True, slots=True)
class FindingView:
    """A finding of the diet."""

    kind: str
    message: str
    label: str
    saving: str
    scenarios: str
    proof: str
    kept: str
    doubt: str
    places: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class DietView:
    """What the model could be without."""

    summary: str
    findings: tuple[FindingView, ...]
    where: str
    command: str
    file: str
    """The address of the report."""


@dataclass(frozen=True, slots=True)
class MeasuredView:
    """All of it."""

    card: tuple[tuple[str, str], ...]
    """More of the model's facts, as pairs of words."""
    scenarios: tuple[ScenarioView, ...]
    where: str
    """Machine and versions; empty where nothing was measured."""
    command: str
    """What measures it, again or for the first time."""
    file: str
    """The address of the report; empty where there is none."""
    diet: DietView | None
    diet_command: str


def measured_view(library: Library, place: urls.Place, model: MjcfModel) -> MeasuredView:
    """What the page of a model shows of its reports."""
    words, name = library.words, model.name
    scene, diet = library.reports.scenes.get(name), library.reports.diets.get(name)
    scenarios = () if scene is None else scene.scenarios
    return MeasuredView(
        card=_card(words, model, scene),
        scenarios=tuple(_scenario(words, one) for one in scenarios),
        where="" if scene is None else where(words, scene.machine),
        command=again("bench", name, "--record"),
        file="" if scene is None else place.href(urls.file_path(bench_path(name))),
        diet=None if diet is None else _diet(words, place, diet),
        diet_command=again("diet", name, "--record"),
    )


def _card(
    words: Strings, model: MjcfModel, scene: SceneReport | None
) -> tuple[tuple[str, str], ...]:
    missing = words("measured.not")
    text = len(model.source.text.encode())
    card = None if scene is None else scene.card
    own = None
    if scene is not None and scene.scenarios:
        own = next((row.realtime for row in scene.scenarios[0].rows if row.own), None)
    speed = words("measured.times", factor=factor(own)) if own is not None else missing
    if card is None:
        return (
            (words("measured.possible"), missing),
            (words("measured.touched"), missing),
            (words("measured.mjcf_file"), size(text)),
            (words("measured.native"), speed),
            (words("measured.browser"), missing),
        )
    browser = missing
    if card.browser is not None:
        browser = words("measured.times", factor=factor(card.browser))
    return (
        (words("measured.possible"), str(card.possible)),
        (words("measured.touched"), str(card.touched)),
        (words("measured.mjcf"), size(card.mjcf)),
        (words("measured.mjb"), size(card.mjb)),
        (words("measured.native"), speed),
        (words("measured.browser"), browser),
    )


# --- scenarios


def _scenario(words: Strings, report: ScenarioReport) -> ScenarioView:
    return ScenarioView(
        name=report.name,
        title=report.title or report.name,
        about=tuple(_about(words, report)),
        verdict=sentence(report.verdict.text),
        settings=_settings(words, report),
        notes=tuple(_notes(words, report)),
        orders=_orders(words, report.orders),
        stable=_stable(words, report.stable),
    )


def _about(words: Strings, report: ScenarioReport) -> list[str]:
    told = [words("measured.duration", time=seconds_text(report.duration))]
    if report.horizon < report.duration:
        told.append(words("measured.horizon", time=seconds_text(report.horizon)))
        if report.lyapunov is not None:
            told.append(said(words, "measured.chaotic", rate=power(report.lyapunov)))
    if report.hold:
        told.append(words("measured.hold", time=seconds_text(report.hold)))
    usual = usual_setting(report.rows)
    parts = [] if usual is None else solving_parts(usual)
    if parts:
        told.append(words("measured.usual", setting=", ".join(parts)))
    kind = f"measured.reference_{report.reference}"
    told.append(said(words, kind, source=report.source, floor=power(report.floor, 1)))
    if report.second:
        told.append(words("measured.second", source=report.second))
        if report.agreement is not None:
            told.append(said(words, "measured.agreement", difference=power(report.agreement, 2)))
    return told


def _settings(words: Strings, report: ScenarioReport) -> Grid:
    rows, usual = report.rows, usual_setting(report.rows)

    def error(quantity: Quantity) -> tuple[str, list[str]]:
        found: list[str] = [bounded(quantity.of(row), quantity.least) for row in rows]
        key = _QUANTITIES.get(quantity.name)
        return quantity.label if key is None else words(key), found

    remarks = words("measured.remark")
    columns: list[tuple[str, list[str]]] = [
        (words("measured.setting"), [setting_text(row.setting, usual) for row in rows]),
        (words("measured.cost"), ["" if r.cost is None else f"{r.cost:.3g}" for r in rows]),
        (words("measured.realtime"), [factor(row.realtime) for row in rows]),
        *(error(quantity) for quantity in quantities(report) if _is_known(quantity, report)),
        (words("measured.energy"), [percent(row.energy_drift) for row in rows]),
        (words("measured.momentum"), [power(row.momentum_drift, 2) for row in rows]),
        (words("measured.depth"), [power(row.penetration or None, 2) for row in rows]),
        (words("measured.slip"), [power(row.slip, 2) for row in rows]),
        (words("measured.model_error"), [power(row.model_error, 2) for row in rows]),
        (remarks, [_remark(words, report, row) for row in rows]),
    ]
    marked = tuple(n for n, row in enumerate(rows) if row.own)
    label = words("measured.settings", title=report.title or report.name)
    return grid(label, columns, words=(remarks,), marked=marked)


def _is_known(quantity: Quantity, report: ScenarioReport) -> bool:
    """Whether any error is more than what the reference does not resolve."""
    errors = (quantity.of(row) for row in report.rows)
    return any(one is not None and one > quantity.least * (1 + 1e-9) for one in errors)


def _remark(words: Strings, report: ScenarioReport, row: WorkPrecisionRow) -> str:
    parts = [words("measured.own")] if row.own else []
    if row.status != "ok":
        parts.append(status_text(row.status))
    if row.refsafe:
        parts.append("refsafe")
    if row.front:
        parts.append(words("measured.front"))
    elif row.dominated_by is not None:
        better = report.rows[row.dominated_by].setting
        parts.append(words("measured.better", setting=setting_text(better, row.setting)))
    return "; ".join(parts)


def _notes(words: Strings, report: ScenarioReport) -> list[str]:
    """Why runs were lost, those with the same reasons together."""
    usual = usual_setting(report.rows)
    together: dict[tuple[str, ...], list[str]] = {}
    for row in report.rows:
        if row.status != "ok":
            told = (status_text(row.status), *row.reasons)
            together.setdefault(told, []).append(setting_text(row.setting, usual))
    notes = [f"{'; '.join(names)}: {'; '.join(told)}." for told, names in together.items()]
    softened = [setting_text(row.setting, usual) for row in report.rows if row.refsafe]
    if softened:
        notes.append(words("measured.refsafe", settings="; ".join(softened)))
    return notes


def _orders(words: Strings, orders: tuple[OrderRow, ...]) -> Grid | None:
    shown = [o for o in orders if (o.position, o.attitude, o.velocity) != (None, None, None)]
    if not shown:
        return None
    columns = [(words("measured.integrator"), [one.integrator for one in shown])]
    for name, key in ORDERS:
        found: list[float | None] = [getattr(one, name) for one in shown]
        cells = ["" if value is None else f"{value:.2f}" for value in found]
        columns.append((words(key), cells))
    return grid(words("measured.orders"), columns)


def _stable(words: Strings, rows: tuple[StableRow, ...]) -> Grid | None:
    if not rows:
        return None
    again = words("measured.islands")
    columns = [
        (words("measured.integrator"), [one.integrator for one in rows]),
        (words("measured.largest"), [largest(words, one.largest, one.searched) for one in rows]),
        (words("measured.remark"), ["" if one.monotone else again for one in rows]),
    ]
    return grid(words("measured.stable"), columns, words=(words("measured.remark"),))


def largest(words: Strings, value: float | None, searched: tuple[float, float]) -> str:
    """A largest stable timestep in words."""
    if value is None:
        return words("measured.stable_all", time=seconds_text(searched[1]))
    if value == 0:
        return words("measured.stable_none", time=seconds_text(searched[0]))
    return seconds_text(value)


# --- the diet


def _diet(words: Strings, place: urls.Place, diet: DietReport) -> DietView:
    open_ones = sum(one.counts for one in diet.findings)
    summary = words("measured.diet_open", n=open_ones) if open_ones else words("measured.slim")
    lost = [f"{one.name}: {'; '.join(one.reasons)}" for one in diet.scenarios if one.status != "ok"]
    if lost:
        summary += " " + words("measured.diet_lost", scenarios="; ".join(lost))
    return DietView(
        summary,
        tuple(_finding(words, one) for one in diet.findings),
        where(words, diet.machine),
        again("diet", diet.model, "--record"),
        place.href(urls.file_path(diet_path(diet.model))),
    )


def _finding(words: Strings, one: Finding) -> FindingView:
    label = escape(one.label)
    if one.difference:
        label += Markup(" ({})").format(whole(power(one.difference, 2)))
    return FindingView(
        kind=one.kind,
        message=sentence(one.message),
        label=label,
        saving=_saving(words, one.saving),
        scenarios=", ".join(one.scenarios),
        proof=one.proof,
        kept=one.kept,
        doubt=one.doubt,
        places=tuple(f"{at.path}:{at.line}" for at in one.places),
    )


def _saving(words: Strings, saving: Saving) -> str:
    parts = []
    if saving.time is not None:
        text = words("measured.saves_time", factor=f"{saving.time:.3g}")
        parts.append(text if saving.certain else words("measured.saves_none"))
    if saving.memory:
        parts.append(words("measured.saves_memory", size=size(saving.memory)))
    if saving.text:
        parts.append(words("measured.saves_text", size=size(saving.text)))
    return ", ".join(parts)
