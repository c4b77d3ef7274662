"""What was measured on a model, as its page shows it.

Entry points: `measured_view(library, place, model)`, `draw_measured`; `measured_facts`. What was
not measured is said to be so, with the command that measures it.
"""

from __future__ import annotations

from markupsafe import Markup, escape
from msgspec import Struct

from coursebuild.core.model import MjcfModel, scenario_anchor
from coursebuild.core.pages import urls
from coursebuild.core.pages.library import Library
from coursebuild.core.pages.renderer import Renderer
from coursebuild.core.pages.strings import Strings
from coursebuild.features.bench.figures import factor, power, sentence, size, where, whole
from coursebuild.features.bench.model import declared_scenarios
from coursebuild.features.bench.scenarios import ScenarioView, plots, scenario_view
from coursebuild.numerics.reports.diet import DietReport, Finding, Saving
from coursebuild.numerics.reports.records import BENCH, DIET


class FindingView(Struct, frozen=True):
    """A finding of the diet; the template takes from it what needs no words of the page."""

    finding: Finding
    message: str
    label: str
    saving: str


class DietView(Struct, frozen=True):
    """What the model could be without."""

    summary: str
    findings: tuple[FindingView, ...]
    where: str
    file: str
    """The address of the report."""


class MeasuredView(Struct, frozen=True):
    """All of it."""

    scenarios: tuple[ScenarioView, ...]
    waiting: tuple[tuple[str, str], ...]
    """Of scenarios that are declared, where nothing was measured: id and title."""
    where: str
    """Machine and versions; empty where nothing was measured."""
    command: str
    """What measures it, again or for the first time."""
    file: str
    """The address of the report; empty where there is none."""
    diet: DietView | None
    diet_command: str
    numerics: str
    """The address of the hard cases; empty where there are none."""
    sweeps: tuple[ScenarioView, ...]


def measured_view(library: Library, place: urls.Place, model: MjcfModel) -> MeasuredView:
    """What the page of a model shows of its reports."""
    words, name = library.words, model.name
    scene, diet = library.reports.scenes.get(name), library.reports.diets.get(name)
    scenarios = () if scene is None else scene.scenarios
    sweeps = () if scene is None else scene.sweeps
    declared = declared_scenarios(library.course, name)
    anchors = {one: scenario_anchor(one) for one in declared}
    return MeasuredView(
        scenarios=tuple(
            scenario_view(words, one, anchors.get(one.name, f"_scenario-{n}"))
            for n, one in enumerate(scenarios, 1)
        ),
        waiting=tuple(
            (anchors[one], title)
            for one, title in declared.items()
            if one not in {scenario.name for scenario in scenarios}
        ),
        where="" if scene is None else where(words, scene.machine),
        command=BENCH.command(name),
        file="" if scene is None else place.href(urls.file_path(BENCH.path(name))),
        diet=None if diet is None else _diet(words, place, diet),
        diet_command=DIET.command(name),
        numerics=place.href(urls.NUMERICS) if library.reports.cases else "",
        sweeps=tuple(
            scenario_view(words, one, scenario_anchor(f"sweep-{one.name}")) for one in sweeps
        ),
    )


def draw_measured(renderer: Renderer, view: MeasuredView) -> Markup:
    """The part of the page."""
    drawn = tuple(plots(f"_plot-{n}", one.report) for n, one in enumerate(view.scenarios, 1))
    swept = tuple(plots(f"_sweep-{n}", one.report) for n, one in enumerate(view.sweeps, 1))
    return renderer.render("bench/measured.html", measured=view, plots=drawn + swept)


def measured_facts(library: Library, model: MjcfModel) -> tuple[tuple[str, str], ...]:
    """What the model is made of, and how fast it runs, as pairs of words."""
    words, scene = library.words, library.reports.scenes.get(model.name)
    missing = words("measured.not")

    def speed(times: float | None) -> str:
        return missing if times is None else words("measured.times", factor=factor(times))

    own = browser = None
    if scene is not None and scene.scenarios:
        own = next((row.realtime for row in scene.scenarios[0].rows if row.own), None)
    text = size(len(model.source.text.encode()))
    made = {"possible": missing, "touched": missing, "mjcf_file": text}
    if scene is not None and (card := scene.card) is not None:
        browser = card.browser
        made = {"possible": str(card.possible), "touched": str(card.touched)}
        made |= {"mjcf": size(card.mjcf), "mjb": size(card.mjb)}
    told = made | {"native": speed(own), "browser": speed(browser)}
    return tuple((words(f"measured.{name}"), said) for name, said in told.items())


def _diet(words: Strings, place: urls.Place, diet: DietReport) -> DietView:
    open_ones = sum(one.is_fault for one in diet.findings)
    summary = words("measured.diet_open", n=open_ones) if open_ones else words("measured.slim")
    lost = [f"{one.name}: {'; '.join(one.reasons)}" for one in diet.scenarios if one.status != "ok"]
    if lost:
        summary += " " + words("measured.diet_lost", scenarios="; ".join(lost))
    return DietView(
        summary,
        tuple(_finding(words, one) for one in diet.findings),
        where(words, diet.machine),
        place.href(urls.file_path(DIET.path(diet.model))),
    )


def _finding(words: Strings, one: Finding) -> FindingView:
    label = escape(one.label)
    if one.difference:
        label += Markup(" ({})").format(whole(power(one.difference, 2)))
    return FindingView(one, sentence(one.message), label, _saving(words, one.saving))


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
