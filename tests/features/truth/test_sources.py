"""Numbers that are held against the labs and models of their lesson."""

from __future__ import annotations

from pathlib import Path

import pytest

from coursebuild.features.truth.claims import check_sources, document_claims, unbound_results
from coursebuild.pipeline.load import load_course
from support.fixture_cases import fixture_text
from support.rule_cases import Layout

COURSE = fixture_text("documents/truth_course.txt")


def test_a_number_of_a_lab_is_in_it_or_in_its_model(tmp_path: Path) -> None:
    Layout.of(COURSE).write(tmp_path)
    course = load_course(tmp_path)
    document = course.documents[0]
    diagnostics = check_sources(course, [(document, document_claims(document))])
    assert [d.message for d in diagnostics] == ["`#lab:box` has no number `2.5`"]


MAP = fixture_text("documents/truth_map.txt")


@pytest.mark.parametrize(("course", "result"), [(COURSE, "17.3"), (MAP, "4.34")])
def test_what_no_lab_model_or_binding_gives_is_listed(
    tmp_path: Path, course: str, result: str
) -> None:
    Layout.of(course).write(tmp_path)
    results = [c.text for _, claims in unbound_results(load_course(tmp_path)) for c in claims]
    assert results == [result]


UNITS = fixture_text("documents/truth_units.txt")


def test_a_unit_ends_where_its_phrase_does(tmp_path: Path) -> None:
    """`s at` are no attoseconds, and `in` before code or a formula is a word."""
    Layout.of(UNITS).write(tmp_path)
    claims = document_claims(load_course(tmp_path).documents[0]).open
    values = {claim.text: claim.values[-1][0] for claim in claims}
    assert values == {"2.5": 2.5, "0.5": 0.5, "35": 35 * 86400, "0.3": 0.3, "0.4": 0.4}
