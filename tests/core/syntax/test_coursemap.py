"""The course map and files beside models: what they become, and what can be wrong in them."""

from __future__ import annotations

from decimal import Decimal

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coursebuild.core.model import (
    CalloutKind,
    Comparison,
    Course,
    Declarations,
    Filter,
    Measured,
    Mode,
    Silence,
)
from coursebuild.core.model.vocabulary import CALLOUTS
from coursebuild.core.syntax.coursemap import parse_course_map
from coursebuild.core.syntax.declarations import parse_declarations
from coursebuild.core.text.diagnostics import Parsed
from coursebuild.core.text.source import Source


def parse(text: str) -> Parsed[Course | None]:
    return parse_course_map(Source("content/course.toml", text))


COMPLETE = r"""# the course
[course]
title = "Simulation with MuJoCo"
summary = "From a first step to $\\tau$."
language = "pt-BR"
base_url = "https://example.org/course/"
repository = "https://example.org/course.git"
licence = "CC-BY-4.0"
engine = "3.14.0"

[verify]
rtol = 1e-6
atol = 0
ellipsis = true
[[verify.filter]]
pattern = 'took (\d+) s'
replacement = 'took \1'

[callouts]
warning = "Aviso"
lab = { label = "In the lab", promise = "Done by hand." }
try = { label = "Experimente" }

[[silence]]
rule = "heading-skip"
reason = "the layout of the exercises"
path = "content/lessons/4.*"

[[level]]
id = 4
title = "Rigid bodies"
summary = "What turns."

[[level.lesson]]
id = "4.1"
slug = "rotations"
title = "Rotations"
status = "planned"

[[level.lesson]]
id = "4.2"
slug = "mass-and-inertia"
title = "Mass and inertia"
status = "complete"
summary = "How hard it is to spin."
objectives = ["Compose inertias", "Find principal axes"]
prerequisites = ["4.1",
  "A.1"]
minutes = 90

[[level]]
id = "A"
title = "Appendix"
lesson = [ { id = "A.1", slug = "a", title = "Units", status = "draft" } ]

[[page]]
id = "about"
title = "About"
file = "content/pages/about.md"
"""


@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_a_complete_map(newline: str) -> None:
    parsed_map = parse(COMPLETE.replace("\n", newline))
    assert parsed_map.diagnostics == ()
    course = parsed_map.value
    assert course is not None
    assert (course.title, course.summary) == (
        "Simulation with MuJoCo",
        "From a first step to $\\tau$.",
    )
    assert (course.language, course.licence, course.engine) == ("pt-BR", "CC-BY-4.0", "3.14.0")
    assert course.base_url == "https://example.org/course/"
    assert course.repository == "https://example.org/course.git"
    assert course.engine_span.text == '"3.14.0"'
    assert course.comparison == Comparison(Mode.TOLERANCE, Decimal("1e-6"), Decimal(0), True)
    assert course.filters == (Filter(r"took (\d+) s", r"took \1"),)
    assert course.silences == (
        Silence("heading-skip", "the layout of the exercises", "content/lessons/4.*"),
    )
    assert [(level.id, level.title, level.summary) for level in course.levels] == [
        ("4", "Rigid bodies", "What turns."),
        ("A", "Appendix", ""),
    ]
    first, second, third = course.lessons
    assert (first.id, first.status, first.minutes) == ("4.1", "planned", None)
    assert (second.slug, second.status, second.minutes) == ("mass-and-inertia", "complete", 90)
    assert second.objectives == ("Compose inertias", "Find principal axes")
    assert second.prerequisites == ("4.1", "A.1")
    assert [span.text for span in second.prerequisite_spans] == ['"4.1"', '"A.1"']
    assert [span.line for span in second.prerequisite_spans] == [47, 48]
    assert second.span.text.startswith("[[level.lesson]]") and second.span.text.endswith("= 90")
    assert second.path == "content/lessons/4.2-mass-and-inertia.md"
    assert (third.id, third.level, third.status) == ("A.1", "A", "draft")
    assert course.levels[0].span.contains(second.span)
    (page,) = course.pages
    assert (page.id, page.title, page.path) == ("about", "About", "content/pages/about.md")
    kinds = {kind.name: kind for kind in course.callouts}
    assert list(kinds) == [*CALLOUTS, "lab"]
    for name, label in (("warning", "Aviso"), ("try", "Experimente")):
        assert kinds[name] == CalloutKind(name, label)
    assert (kinds["lab"].label, kinds["lab"].promise) == ("In the lab", "Done by hand.")
    assert kinds["note"] == CalloutKind("note")


def test_a_minimal_map() -> None:
    course = parse('[course]\ntitle = "T"\n').value
    assert course is not None
    assert (course.language, course.engine) == ("en", None)
    assert (course.base_url, course.repository, course.licence) == ("", "", "")
    assert course.comparison == Comparison()
    assert (course.filters, course.silences, course.levels, course.pages) == ((), (), (), ())
    assert [kind.name for kind in course.callouts] == list(CALLOUTS)


@pytest.mark.parametrize(
    ("verify", "expected"),
    [
        ("", Comparison()),
        ('compare = "exact"', Comparison()),
        ('compare = "digits"', Comparison(Mode.DIGITS)),
        ('compare = "rtol"\nrtol = 0.001', Comparison(Mode.TOLERANCE, Decimal("0.001"))),
        ("rtol = 1e-3", Comparison(Mode.TOLERANCE, Decimal("0.001"))),
        ("atol = 1_000.5", Comparison(Mode.TOLERANCE, Decimal(0), Decimal("1000.5"))),
        ("atol = 0x10", Comparison(Mode.TOLERANCE, Decimal(0), Decimal(16))),
        ("ellipsis = true", Comparison(ellipsis=True)),
    ],
)
def test_how_outputs_are_compared(verify: str, expected: Comparison) -> None:
    course = parse(f'[course]\ntitle = "T"\n[verify]\n{verify}\n').value
    assert course is not None and course.comparison == expected


@settings(max_examples=100)
@given(st.data())
def test_any_edit_of_a_valid_text_is_parsed_or_reported(data: st.DataObject) -> None:
    at = data.draw(st.integers(0, len(COMPLETE)))
    piece = data.draw(
        st.sampled_from([*"[]{}=.,\"'\\\n#", "id = 4.2\n", "[[level]]\n", "[course]\n", "1", "\r"])
        | st.text(max_size=3)
    )
    mutated = COMPLETE[:at] + piece + COMPLETE[at + data.draw(st.integers(0, 20)) :]
    parsed_map = parse(mutated)
    assert parsed_map.value is not None or parsed_map.diagnostics
    orders = [d.order for d in parsed_map.diagnostics]
    assert orders == sorted(orders)


DECLARATIONS = """\
# the arm
[bench]
visible = 0.02
visible_angle = 2

[[scenario]]
name = "reach"
title = "A reach"
keyframe = "home"
qpos = [0, 1.5]
qvel = [0.5, 0]
duration = 2
sample = 0.1
controls = [[0.5, 0.3], [-0.5, 1.0], [0, 0]]
hold = 0.5
measure = "site:tip of it"
reference = "ode"
conserved = []
timesteps = [0.001, 0.05]

[[scenario]]
name = "rest"
keyframe = 0
reference = "closed:damped-spring-0.1"
conserved = ["energy", "angular-momentum"]

[[scenario]]
name = "other"
controls = [[1, 2]]
reference = "self"

[[sweep]]
name = "soft"
scenario = "rest"
vary = { "geom:a b.solref" = [[0.1, 1]], "option.cone" = ["elliptic"], "body.mass" = "± 2.5 %" }
show = ["penetration"]

[[keep]]
finding = "sensor-unread tip"
reason = "lesson 5.2 reads it"
"""


def parse_beside_model(text: str) -> Parsed[Declarations | None]:
    return parse_declarations(Source("models/arms/arm.toml", text))


@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_a_complete_file(newline: str) -> None:
    parsed_file = parse_beside_model(DECLARATIONS.replace("\n", newline))
    assert not parsed_file.diagnostics
    declarations = parsed_file.value
    assert declarations is not None
    assert declarations.model == "arms/arm"
    assert (declarations.bench.visible, declarations.bench.visible_angle) == (0.02, 2.0)
    first, second, third = declarations.scenarios
    assert (first.name, first.title, first.keyframe) == ("reach", "A reach", "home")
    assert (first.qpos, first.qvel) == ((0.0, 1.5), (0.5, 0.0))
    assert (first.duration, first.sample, first.hold) == (2.0, 0.1, 0.5)
    assert first.controls == ((0.5, 0.3), (-0.5, 1.0), (0.0, 0.0))
    assert first.observable == Measured("site", "tip of it")
    assert (first.reference, first.closed_form, first.conserved) == ("ode", "", ())
    assert first.timesteps == (0.001, 0.05)
    assert first.place("keyframe").text == '"home"'
    assert first.place("nothing").text == "[[scenario]]"
    assert (second.keyframe, second.closed_form) == (0, "damped-spring-0.1")
    assert second.conserved == ("energy", "angular-momentum")
    assert (second.duration, second.sample, second.hold, second.measure) == (None, None, None, None)
    assert (third.title, third.keyframe, third.reference) == (None, None, "self")
    assert third.conserved is None
    (sweep,) = declarations.sweeps
    assert (sweep.name, sweep.scenario, sweep.show) == ("soft", "rest", ("penetration",))
    assert [
        (variation.parameter, variation.values, variation.relative)
        for variation in sweep.variations
    ] == [
        ("geom:a b.solref", ((0.1, 1.0),), False),
        ("option.cone", ("elliptic",), False),
        ("body.mass", (0.975, 1.025), True),
    ]
    assert sweep.variations[0].span.text == '"geom:a b.solref"'
    (keep,) = declarations.keep
    assert (keep.finding, keep.reason) == ("sensor-unread tip", "lesson 5.2 reads it")
    assert keep.finding_span.text == '"sensor-unread tip"'


@pytest.mark.parametrize("text", ["", "# nothing\n", "[bench]\n"])
def test_an_empty_file(text: str) -> None:
    parsed_file = parse_beside_model(text)
    assert parsed_file.diagnostics == ()
    assert parsed_file.value is not None
    assert (parsed_file.value.scenarios, parsed_file.value.keep) == ((), ())
    assert (parsed_file.value.bench.visible, parsed_file.value.bench.visible_angle) == (0.01, 1.0)


@settings(max_examples=60)
@given(st.text(alphabet='[]{}"=.,#\nabcdefghijklmnopqrstuvwxyz0123456789- é', max_size=80))
def test_no_text_makes_reading_scenarios_raise(text: str) -> None:
    parse_beside_model(text)
    parse_beside_model(DECLARATIONS + text)
