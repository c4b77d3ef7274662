"""What was measured, on the pages of models and on that of the hard cases."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path

import pytest
from msgspec.structs import replace

from coursebuild.core.model.results import Reports
from coursebuild.core.pages.materials import strings_for
from coursebuild.features.bench.grids import bounded, factor, percent, power, sentence, size
from coursebuild.features.markdown.from_html import html_to_markdown
from mjbench.reports.model_report import StepCost
from samples.reports import interval
from support.bench_reports import swing
from support.fixture_cases import fixture_tables
from support.model_reports import box, case, diet, reports, row, run, scenario, scene
from support.rendered_course import MAP, Make

ROOT = Path(__file__).parents[3]


def test_numbers_and_sentences_as_text() -> None:
    """Three digits, and a power of ten where a number needs one; a thin space before a unit."""
    cases = fixture_tables("measured")
    for write in (power, percent, factor, size, sentence):
        for value, text in cases[write.__name__]:
            assert write(value).replace("\u2009", " ") == text
    assert [power(math.nan), power(None), factor(None)] == ["nan", "", ""]
    assert bounded(1e-11, 1e-11) == "&lt; 1.0\u2009×\u200910<sup>−11</sup>"
    assert [bounded(v, 0.0) for v in (None, 0.0, 0.5)] == ["", "0", "0.500"]
    assert bounded(0.002, 1e-3) == "0.00200"


def pages(make: Make, reports: Reports) -> dict[str, str]:
    files = make("## A\n\nText.\n").site(reports=reports)
    return {path: data.decode() for path, data in files.items() if path.endswith(".html")}


@pytest.fixture(scope="module")
def site(make: Make) -> dict[str, str]:
    return pages(make, reports())


def text(html: str) -> str:
    """The text of a page in one line."""
    body = html[html.index("<main") : html.index("</main>")]
    bare = re.sub(r"<svg.*?</svg>", " ", body, flags=re.DOTALL)
    bare = re.sub(r"</?span[^>]*whole[^>]*>|(?<=</sup>)</span>", "", bare)
    bare = re.sub(r"<(?!/?sup)[^>]*>", " ", bare)
    return " ".join(bare.replace("\u2009", " ").split())


def test_the_card_of_a_model(site: dict[str, str]) -> None:
    words = text(site["models/box.html"])
    assert "Pairs of geoms that may touch 7 Pairs that touch in the scenarios 2" in words
    assert "MJCF, with its files 12 kB Compiled (MJB) 99 MB" in words
    assert "Speed natively 100 × real time Speed in WebAssembly 151 × real time" in words


def test_a_scenario_has_its_plots_tables_and_figures_as_a_file(site: dict[str, str]) -> None:
    page = site["models/box.html"]
    words = text(page)
    assert "A pendulum swings RK4 at 20 ms costs 0.39 times as much" in words
    assert (
        "Largest stable timesteps over 10 s, with at most 2.5 J Integrator Largest stable timestep "
        "Remark Euler 40 ms implicit all up to 100 ms RK4 80 ms; from its own start 90 ms some are "
        "stable again, from 95 ms to 97 ms"
    ) in words
    assert "Reference by another integration (known to 1 × 10<sup>−12</sup>)" in words
    assert page.count('class="work-precision"') == 4, "two scenarios, for wide and narrow screens"
    names = re.findall(r'aria-labelledby="(_plot[^"]*)"', page)
    ids = {name for pair in names for name in pair.split()}
    assert len(ids) == 8 and all(page.count(f'id="{name}"') == 1 for name in ids)
    own_rows = re.findall(r'<tr class="own"><th scope="row">(.*?)</th>', page)
    assert own_rows[0] == "Euler at 2 ms"
    assert "Euler at 50 ms: diverged; the state is not finite." in words
    assert "coursebuild" not in words, "a page for readers names no command of authors"
    assert 'href="../files/reports/box.bench.json"' in page
    assert "MuJoCo 3.14.0, Python 3.11.7, NumPy 2.3.0; Linux x86_64, A Processor @ 2 GHz." in words


def test_what_was_measured_is_told_in_the_language_of_the_page(make: Make) -> None:
    course = MAP.replace('language = "en"', 'language = "de"')
    german = make("## A\n\nText.\n", course=course)
    brief = replace(reports().scenes["box"], scenarios=(scenario(swing().rows, duration=2.5),))
    files = german.site(reports=Reports({"box": brief}))
    page = files["models/box.html"].decode()
    words = text(page)
    assert "Das Szenario dauert 2,5 s." in words
    assert re.search(r"RK4 mit 20 ms 0,39 ", words)
    labels = re.findall(r"<(?:text|title|desc)\b[^>]*>([^<]+)", page)
    assert "Kosten, relativ zur Einstellung der Szene" in labels
    english = re.compile(r"\b(the|is|of|at|than|with|errors?|cost|steps|better)\b")
    assert [t for t in labels if english.search(t)] == []


def test_every_text_of_the_reports_has_a_translation(make: Make) -> None:
    english, german = (strings_for(make.assets.templates, name).translate for name in ("en", "de"))
    for report_text, expected in fixture_tables("measured")["german"]:
        assert german(report_text) == expected
        assert english(report_text) == report_text
    left = re.compile(r"\b(the|is|of|at|than|takes|errs|which|it)\b")
    for path in sorted((ROOT / "content/reports").glob("*.bench.json")):
        for report in json.loads(path.read_bytes())["scene"]["scenarios"]:
            texts = [report["verdict"]["text"]]
            for chart in report["charts"]:
                texts += chart["axes"] + [m["text"] for m in chart["levels"] + chart["marks"]]
            assert [t for t in map(german, texts) if left.search(t)] == [], path.name


def test_where_the_duration_ended_the_search_for_stable_timesteps(make: Make) -> None:
    remark = "longer ones were not tried: 20 of these are the whole scenario"
    for duration, expected in ((2.0, True), (2.1, False)):
        fields = {"stable": swing().stable, "duration": duration}
        long = scenario(swing().rows, title="A pendulum swings", **fields)
        page = pages(make, Reports({"box": scene(long, model="box")}))["models/box.html"]
        assert (remark in text(page)) is expected


def test_an_error_that_the_reference_does_not_resolve_has_no_column(make: Make) -> None:
    flat = [row(velocity=(1e-11, 1e-11), position=(2e-3, 1e-3), own=True)]
    flat_scenario = scenario(flat, floor=1e-12, velocity_floor=1e-12)
    page = pages(make, Reports({"box": scene(flat_scenario, model="box")}))["models/box.html"]
    heads = re.findall(r"<th scope=\"col\"[^>]*>(.*?)</th>", page)
    assert "Position (m or rad)" in heads
    assert "Velocity (m/s or rad/s)" not in heads


def test_the_diet_of_a_model(site: dict[str, str]) -> None:
    words = text(site["models/box.html"])
    assert "One part of this model changes nothing that happens in its scenarios." in words
    assert "sensor-unread Nothing reads &lt;this&gt; sensor." in words
    assert "proved; ×1.07 as fast, 120 B of memory, 40 B of text (swing)." in words
    assert "Because its value goes nowhere. models/box.xml:3" in words
    assert "Kept: it is the horizon." in words
    assert "It is not a fault, because examples/a.py names &lt;it&gt;." in words
    assert 'href="../files/reports/box.diet.json"' in site["models/box.html"]


def test_what_was_measured_in_part(make: Make) -> None:
    """Facts that nobody measured have no row; the size of the file is known without measuring."""
    half = pages(make, Reports({"box": box(None)}, {"box": diet()}))["models/box.html"]
    facts = text(half).partition(" Facts ")[2].partition(" Speed against error ")[0]
    assert facts.endswith("unnamed The MJCF file 46 B Speed natively 100 × real time")
    assert "not measured" not in text(half).lower()
    assert "Nothing in this model could be left out" in text(half)


def test_the_page_of_the_hard_cases(site: dict[str, str]) -> None:
    first = text(site["numerics/index.html"])
    assert first.index("Damped spring") > first.index("A &lt;top&gt;"), "in the order of numbers"
    page = site["numerics/case-5.html"]
    words = text(page)
    assert words.startswith("Course map Hard cases Damped spring ")
    assert (
        "References: the oscillator; Bulirsch–Stoer. The motion is known to "
        "1 × 10<sup>−13</sup> in position and 4 × 10<sup>−13</sup> in velocity."
    ) in words
    assert "Euler 200 ms 200.1 ms" in words
    assert "RK4 250 ms; elsewhere 290 ms" in words
    assert "implicit, discrete all up to 1 s" in words
    assert "Theory: 2/ω." in words
    assert "Period (s) 2π√(m/k) Euler, RK4 6.28 6.28 −1.9 × 10<sup>−4</sup>" in words
    assert "Energy RK4 −4.10 × 10<sup>−10</sup> 0 −4.1 × 10<sup>−10</sup> Euler not finite" in words
    assert "Euler 1.00 ± 0.01, bend 0.02" in words
    assert "Euler at 500 ms: diverged; 1e9 rad/s." in words
    assert "coursebuild" not in words
    assert 'href="../files/reports/stability.json"' in page
    assert 'href="../numerics/index.html"' in site["models/box.html"]
    assert 'href="numerics/index.html"' in site["index.html"]


def picture(page: str) -> dict[str, list[str]]:
    """What the picture of all cases says and how it is coloured, by the title of a row."""
    rows = re.findall(r'<tr><th scope="row">(.*?)</th>(.*?)</tr>', page)
    cells = r'<td (?:class="shade-(.)"|colspan="5")>(.*?)</td>'
    return {
        re.sub("<.*?>", "", title): [
            text if shade == "3" else f"{text}{shade and f' ({shade})'}"
            for shade, text in re.findall(cells, row)
        ]
        for title, row in rows
    }


def test_the_page_of_a_family_links_the_labs_with_its_label(make: Make) -> None:
    lab = 'x = {min = 0, max = 1}\nplots = [{traces = [{label = "y", expr = "x"}]}]'
    texts = (f"```lab plot {{#lab:{name}}}\n{lab}\n```\n" for name in ("spring", "top"))
    files = make("## A\n\n" + "\n".join(texts)).site(
        reports=Reports(cases=(case("spring-1", 5), case("springs", 6), case("top", 3)))
    )
    page = files["numerics/case-5.html"].decode()
    assert re.findall(r'href="[^"]*(#lab[^"]*)">Try it in a lab: ', page) == ["#lab%3Aspring"]
    assert b"Try it in a lab" not in files["numerics/case-6.html"]


def test_the_page_begins_with_a_picture_of_cases_and_integrators(make: Make) -> None:
    lost = replace(case().boundaries[0], largest="none")
    costs = (StepCost("RK4", interval(1e-6)),)
    cheap = case("cheap", 4, errors=(run(integrator="RK4", position=(1e-4, 1e-4)),), costs=costs)
    cases = (case("spring", 5), replace(case("lost", 5), boundaries=(lost,), orders=()), cheap)
    outputs = make("## A\n\nText.\n").site(reports=Reports(cases=cases))
    files = {path: data.decode() for path, data in outputs.items() if path.endswith(("html", "md"))}
    page = files["numerics/index.html"]
    rows = picture(page)
    assert rows["A &lt;spring&gt;"] == [
        *("200 ms", "any (0)", "–", "250 ms", "any (0)"),
        *("1.00 (0)", "–", "–", "–", "–"),
        "–",
    ]
    assert rows["A &lt;lost&gt;"] == ["none", "–", "–", "–", "–", "–", "–"]
    *_, cost = rows["A &lt;cheap&gt;"][-5:-1]
    assert rows["A &lt;cheap&gt;"][-1] == "–" and cost.endswith("s (0)"), "the only one so exact"
    table = [line.split(" | ") for line in files["numerics/index.md"].splitlines()]
    [column] = [n for line in table for n, cell in enumerate(line) if cell == cost[:-4]]
    assert column == 14, "in the same column as on the page"
    heads = re.findall(r'<th scope="col">(.*?)</th>', page)
    assert heads[1:] == ["Euler", "implicit", "implicitfast", "RK4", "discrete"] * 3
    assert 'href="case-5.html#spring"' in page and 'id="spring"' in files["numerics/case-5.html"]
    assert "numerics/case-6.html" not in files, "of which nothing is recorded"


def test_errors_and_energy_are_drawn_against_time(make: Make) -> None:
    runs = [
        run(integrator=name, timestep=h, position=(h**power, h**power), energy_drift=-(h**2))
        for name, power in (("Euler", 1), ("RK4", 4))
        for h in (0.1, 0.05, 0.025)
    ]
    lost = run(timestep=0.2, status="diverged")
    costs = tuple(StepCost(name, interval(1e-6)) for name in ("Euler", "RK4"))
    site_reports = Reports(cases=(case("a", 4, errors=(lost, *runs), costs=costs),))
    page = pages(make, site_reports)["numerics/case-4.html"]
    assert page.count("<svg") == 2 and page.index("<svg") < page.index("more-figures")
    assert "Euler: errors 0.1 to 0.025 at 1e-05 to 4e-05 s. RK4: errors 0.0001 to " in page
    assert "error of position (m or rad) against processor time" in page
    assert "energy drift, relative against processor time" in page
    assert "<title>Euler at 200 ms: diverged</title>" in page
    assert "Only RK4 reaches an error of 10⁻³, at 10 µs for a simulated second." in page


def test_a_hard_case_of_an_unknown_number_goes_by_its_own_title(make: Make) -> None:
    last_case = case("c", 99, boundaries=(), figures=())
    site_reports = Reports(cases=(case("a", 4), case("b", 99), last_case))
    files = pages(make, site_reports)
    assert "Hard cases A &lt;a&gt; No timestep" in text(files["numerics/case-4.html"])
    assert "Hard cases A &lt;b&gt; A &lt;b&gt; No timestep" in text(files["numerics/case-99.html"])
    folds = [files[f"numerics/case-{n}.html"].count('<details class="case"') for n in (4, 99)]
    assert folds == [0, 2], "one alone is never folded"
    copy = html_to_markdown(files["numerics/case-99.html"], str)
    assert copy.count("\n## A") == 2, "headings stay headings in a fold"
