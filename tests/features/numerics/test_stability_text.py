"""The report on the hard cases, as text."""

from __future__ import annotations

from pathlib import Path

from msgspec.structs import replace

from coursebuild.features.numerics.commands import stability_text
from coursebuild.report import Style
from support.fixture_cases import check_text
from support.model_reports import case


def test_text_puts_integrators_with_equal_figures_together(rewriting: bool) -> None:
    first, *remaining = case().boundaries
    none = replace(first, integrator="none", largest=0.0, theory=0.0, difference=None)
    text = stability_text([case(boundaries=(first, *remaining, none))], Style())
    check_text(Path(__file__).with_name("spring.txt"), text, rewriting=rewriting)
