"""Quantities in formulas, sentences and tables: what is right holds, what is wrong is refused."""

from __future__ import annotations

import re

from hypothesis import given
from hypothesis import strategies as st

from coursebuild.core.model.course import ENGLISH, Words
from coursebuild.core.pages.materials import words_for
from coursebuild.core.scripts.bindings import PrintedOutputs
from coursebuild.core.scripts.compare import verify
from coursebuild.core.scripts.findings import output_findings, unproven_units
from coursebuild.core.syntax.document import parse_document
from coursebuild.core.text.numbers import scan
from coursebuild.core.text.quantities import (
    are_different,
    unit_behind,
    unit_of_header,
    unit_of_printed,
)
from coursebuild.core.text.source import Source
from coursebuild.features.arithmetic.symbol_values import check_formulas
from support.fixture_cases import fixture_text
from support.rendered_course import read_assets
from support.sample_lessons import course, make_run

SCRIPT = "```python file=examples/a.py\nprint(1)\n```\n\n"


def sentences() -> list[tuple[str, str, str, str]]:
    """The language, verdict, output and text of each line."""
    language, lines = "", []
    for line in fixture_text("documents/quantities.txt").splitlines():
        if line.startswith("["):
            language = line.strip("[]")
        elif line and not line.startswith("#"):
            verdict, _, rest = line.partition(": ")
            printed, arrow, text = rest.partition(" => ")
            lines.append((language, verdict, *((printed, text) if arrow else ("", rest))))
    return lines


def judge(printed: str, text: str, words: Words) -> str:
    """The verdict on a formula, or on a sentence or column below what a script printed."""
    stdout, text = (part.replace("⏎", "\n") for part in (f"{printed}⏎", text))
    column = re.fullmatch(r"\| (.*) \| (\S*) \|", text)
    if not printed:
        lesson = text
    elif column is None:
        lesson = f"{SCRIPT}```output\n{stdout}```\n\n{text}\n"
    else:
        header, cell = column.groups()
        lesson = f"{SCRIPT}Output:\n\n| name | {header} |\n| --- | --- |\n| a | {cell} |\n"
    source = Source("content/lessons/4.2-mass.md", lesson)
    document = parse_document(source, frozenset(), lesson=True, words=words).value
    if not printed:
        kinds = {c.kind for group in check_formulas(document).values() for c in group}
        if "wrong" in kinds:
            return "refused"
        return "holds" if kinds == {"holds"} else "not claimed"
    small_course, runs = course(document), [make_run(stdout)]
    verdicts = verify(small_course, runs)
    owners = [(small_course.lessons[0], document)]
    findings = [*output_findings(small_course, owners, PrintedOutputs(verdicts, runs))]
    if any(finding.rule in ("binding-mismatch", "output-drift") for finding in findings):
        return "refused"
    return "not claimed" if any(unproven_units(small_course, runs, verdicts)) else "holds"


PIECES = (
    "m s kg N T in min max per a h d C ° °C % ms 1 2.0 / · ( ) [ ] = : , ^ ^2 ^(1/0) ² ⁻ ⁻¹ ²⁻ | ⏎"
    r" \mathrm{m} \frac{m}{s} $ \, ^\circ rpm J/kg mm² 1/s - 3 0^0 e"
).split()


@given(
    st.text(max_size=40) | st.lists(st.sampled_from((*PIECES, " ", "  ")), max_size=12).map("".join)
)
def test_any_text_can_be_read_for_units(text: str) -> None:
    lines = text.replace("⏎", "\n").split("\n")
    for unit in (unit_behind(text), unit_behind(text, len(text) // 2), unit_of_header(text)):
        assert bool(unit) is bool(unit.readings)
        assert not are_different(unit, unit)
    for number in scan(lines[-1]):
        unit_of_printed(lines[-1], number, lines[:-1])


def test_each_sentence_has_its_verdict() -> None:
    templates = read_assets().templates
    words = {"en": ENGLISH, **{name: words_for(templates, name) for name in ("de", "es", "fr")}}
    offenders = [
        f"{verdict}, not {expected}: {printed} => {text}"
        for language, expected, printed, text in sentences()
        if (verdict := judge(printed, text, words[language])) != expected
    ]
    assert not offenders, "\n".join(offenders)
