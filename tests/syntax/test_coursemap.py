"""The course map: what it becomes, and everything that can be wrong in it."""

from __future__ import annotations

from decimal import Decimal
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coursebuild.diagnostics import Parsed
from coursebuild.model import Comparison, Course, Filter, Mode, Silence, Status
from coursebuild.source import Source
from coursebuild.syntax.coursemap import parse_course_map
from coursebuild.syntax.prerequisites import circles
from coursebuild.vocabulary import CALLOUTS

ROOT = Path(__file__).parents[2]


def parse(text: str) -> Parsed[Course | None]:
    return parse_course_map(Source("content/course.toml", text))


def told(text: str) -> list[str]:
    return [
        f"{d.span.line}:{d.span.column}-{d.span.end_column} {d.rule}: {d.message}"
        + (f" [{d.help}]" if d.help else "")
        for d in parse(text).diagnostics
    ]


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
    parsed = parse(COMPLETE.replace("\n", newline))
    assert parsed.diagnostics == ()
    course = parsed.value
    assert course is not None
    assert course.map.path == "content/course.toml"
    assert (course.title, course.summary) == (
        "Simulation with MuJoCo",
        "From a first step to $\\tau$.",
    )
    assert (course.language, course.licence) == ("pt-BR", "CC-BY-4.0")
    assert (course.base_url, course.repository) == (
        "https://example.org/course/",
        "https://example.org/course.git",
    )
    assert course.engine == "3.14.0"
    assert course.engine_span is not None and course.engine_span.text == '"3.14.0"'
    assert course.comparison == Comparison(Mode.TOLERANCE, Decimal("1e-6"), Decimal(0), True)
    assert course.filters == (Filter(r"took (\d+) s", r"took \1"),)
    assert course.silences == (
        Silence("heading-skip", "the layout of the exercises", "content/lessons/4.*"),
    )
    assert [level.id for level in course.levels] == ["4", "A"]
    assert [level.title for level in course.levels] == ["Rigid bodies", "Appendix"]
    assert course.levels[0].summary == "What turns."
    first, second, third = course.lessons
    assert (first.id, first.status, first.minutes, first.prerequisites, first.level) == (
        "4.1",
        Status.PLANNED,
        None,
        (),
        "4",
    )
    assert (second.slug, second.status, second.minutes) == ("mass-and-inertia", Status.COMPLETE, 90)
    assert second.objectives == ("Compose inertias", "Find principal axes")
    assert second.prerequisites == ("4.1", "A.1")
    assert [span.text for span in second.prerequisite_spans] == ['"4.1"', '"A.1"']
    assert [span.line for span in second.prerequisite_spans] == [47, 48]
    assert second.span.text.startswith("[[level.lesson]]") and second.span.text.endswith("= 90")
    assert second.path == "content/lessons/4.2-mass-and-inertia.md"
    assert (third.id, third.level, third.status) == ("A.1", "A", Status.DRAFT)
    assert course.levels[0].span.contains(second.span)
    assert all(lesson.document is None for lesson in course.lessons)
    (page,) = course.pages
    assert (page.id, page.title, page.path, page.document) == (
        "about",
        "About",
        "content/pages/about.md",
        None,
    )
    assert (course.models, course.files) == ((), ())


def test_callouts_are_the_built_in_ones_and_the_courses_own() -> None:
    course = parse(COMPLETE).value
    assert course is not None
    kinds = {kind.name: kind for kind in course.callouts}
    built_in = {kind.name: kind for kind in CALLOUTS}
    assert list(kinds) == [*built_in, "lab"]
    assert (kinds["warning"].label, kinds["warning"].promise) == (
        "Aviso",
        built_in["warning"].promise,
    )
    assert (kinds["try"].label, kinds["try"].promise) == ("Experimente", built_in["try"].promise)
    assert (kinds["lab"].label, kinds["lab"].promise) == ("In the lab", "Done by hand.")
    assert kinds["note"] == built_in["note"]


def test_every_course_has_the_kinds_of_the_contract() -> None:
    assert {kind.name for kind in CALLOUTS} == {
        *("established", "derivation", "implementation", "recommendation", "research"),
        *("unverified", "version", "warning", "try", "solution", "note", "tip"),
        *("important", "caution"),
    }
    assert all(kind.label and kind.promise for kind in CALLOUTS)


def test_the_least_that_a_map_needs() -> None:
    course = parse('[course]\ntitle = "T"\n').value
    assert course is not None
    assert (course.language, course.base_url, course.repository, course.licence) == (
        "en",
        "",
        "",
        "",
    )
    assert (course.engine, course.engine_span) == (None, None)
    assert course.comparison == Comparison()
    assert (course.filters, course.silences, course.levels, course.pages) == ((), (), (), ())
    assert course.callouts == CALLOUTS


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


def test_the_real_course() -> None:
    text = (ROOT / "content" / "course.toml").read_text(encoding="utf-8")
    assert told(text) == []


HEAD = '[course]\ntitle = "T"\n'
LEVEL = HEAD + '[[level]]\nid = "4"\ntitle = "L"\n'


def lesson(id: str, *required: str, slug: str = "s", status: str = "planned") -> str:
    names = ", ".join(f'"{name}"' for name in required)
    return (
        f'[[level.lesson]]\nid = "{id}"\nslug = "{slug}"\ntitle = "T"\nstatus = "{status}"\n'
        f"prerequisites = [{names}]\n"
    )


LESSON = LEVEL + '[[level.lesson]]\nid = %s\nslug = %s\ntitle = "T"\nstatus = %s\n%s\n'
PATH = "a path relative to the project, as in `content/pages/about.md`"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", "1:1-1 field-missing: `course` is missing"),
        ("[course]\n", "1:1-9 field-missing: `title` is missing"),
        ('title = "T"\n' + HEAD, "1:1-6 field-unknown: unknown field `title`"
         " [known: `callouts`, `course`, `level`, `page`, `silence`, `verify`]"),
        (HEAD + "[pages]\n", "3:2-7 field-unknown: unknown field `pages` [did you mean `page`?]"),
        (HEAD + 'sumary = "S"', "3:1-7 field-unknown: unknown field `sumary`"
         " [did you mean `summary`?]"),
        (HEAD + "title = 2", "3:1-6 field-repeated: `title` is given twice"),
        (HEAD + "engine = 3.14", "3:10-14 field-type: `engine` must be a string, not the number"
         ' 3.14 [put it between quotes: `"3.14"`]'),
        (HEAD + 'engine = "3.14"', "3:10-16 field-value: `engine` cannot be `3.14`"
         " [expected: a version of three numbers, as in `3.14.0`]"),
        (HEAD + 'base_url = "example.org"', "3:12-25 field-value: `base_url` cannot be"
         " `example.org` [expected: an address that begins with `https://` or `http://`]"),
        (HEAD + 'language = "English!"', "3:12-22 field-value: `language` cannot be `English!`"
         " [expected: a language tag, as in `en` or `pt-BR`]"),
        (HEAD + "licence =", '3:10-10 map-syntax: expected a value, found the end of the file'
         ' [an empty text is written `""`]'),
        # levels and lessons
        (HEAD + '[level]\nid = "4"\n', "3:1-8 field-type: `level` must be an array of tables,"
         " not a table [write its header with two brackets: `[[level]]`]"),
        (HEAD + '[[level]]\nid = 4.5\ntitle = "L"\n', "4:6-9 field-type: `id` must be a string or"
         ' an integer, not the number 4.5 [put it between quotes: `"4.5"`]'),
        (HEAD + '[[level]]\nid = "4.5"\ntitle = "L"\n', "4:6-11 field-value: `id` cannot be `4.5`"
         " [expected: letters and digits, as in `4` or `A`]"),
        (HEAD + '[[level]]\nid = -1\ntitle = "L"\n',
         "4:6-8 field-value: `id` must be at least 0, not -1"),
        (LEVEL + '[[level]]\nid = 4\ntitle = "M"\n',
         "7:6-7 id-repeated: the level id `4` is used twice"),
        (LESSON % ("4.2", '"s"', '"planned"', ""), "7:6-9 field-type: `id` must be a string, not"
         ' the number 4.2 [put it between quotes: `"4.2"`]'),
        (LESSON % ('"4"', '"s"', '"planned"', ""), "7:6-9 field-value: `id` cannot be `4`"
         " [expected: letters and digits in parts joined by dots, as in `4.2` or `A.1`]"),
        (LESSON % ('"5.1"', '"s"', '"planned"', ""), "7:6-11 field-value: the lesson `5.1` stands"
         " in the level `4` [an id in this level begins with `4.`]"),
        (LESSON % ('"42.1"', '"s"', '"planned"', ""), "7:6-12 field-value: the lesson `42.1`"
         " stands in the level `4` [an id in this level begins with `4.`]"),
        (LESSON % ('"4.1"', '"Mass and"', '"planned"', ""), "8:8-18 field-value: `slug` cannot be"
         " `Mass and` [expected: lower-case letters and digits in words joined by single hyphens]"),
        (LESSON % ('"4.1"', '"a--b"', '"planned"', ""), "8:8-14 field-value: `slug` cannot be"
         " `a--b` [expected: lower-case letters and digits in words joined by single hyphens]"),
        (LESSON % ('"4.1"', '"s"', '"completed"', ""), "10:10-21 field-value: `status` cannot be"
         " `completed` [did you mean `complete`?]"),
        (LESSON % ('"4.1"', '"s"', '"draft"', "minutes = 0"),
         "11:11-12 field-value: `minutes` must be at least 1, not 0"),
        (LESSON % ('"4.1"', '"s"', '"draft"', 'minutes = "30"'), "11:11-15 field-type: `minutes`"
         " must be an integer, not a string [write it without quotes: `30`]"),
        (LESSON % ('"4.1"', '"s"', '"draft"', 'objectives = "one"'), "11:14-19 field-type:"
         " `objectives` must be an array of strings, not a string"
         ' [put it between brackets: `["one"]`]'),
        (LESSON % ('"4.1"', '"s"', '"draft"', 'objectives = ["one", ""]'),
         "11:22-24 field-value: `objectives[1]` is empty"),
        (LESSON % ('"4.1"', '"s"', '"draft"', "prerequisites = [4.1]"), "11:18-21 field-type:"
         " `prerequisites[0]` must be a string, not the number 4.1"
         ' [put it between quotes: `"4.1"`]'),
        (LEVEL + lesson("4.1") + lesson("4.1"), "13:6-11 id-repeated: the lesson id `4.1` is used"
         " twice"),
        (HEAD + '[[level]]\nid = "A"\ntitle = "L"\n' + lesson("A.b") + lesson("A.B"),
         "13:6-11 id-repeated: the lesson ids `A.b` and `A.B` differ in upper and lower case only"),
        # prerequisites
        (LEVEL + lesson("4.1") + lesson("4.2", "4.11"), "17:18-24 prerequisite-unknown: no lesson"
         " of the map has the id `4.11` [did you mean `4.1`?]"),
        (LEVEL + lesson("4.1", "mass"), "11:18-24 prerequisite-unknown: no lesson of the map has"
         " the id `mass` [known: `4.1`]"),
        (LEVEL + lesson("4.1") + lesson("4.2", "4.1", "4.1"),
         "17:25-30 field-value: the prerequisite `4.1` is named twice"),
        (LEVEL + lesson("4.1", "4.1"),
         "11:18-23 prerequisite-cycle: lesson 4.1 requires itself [remove it]"),
        (LEVEL + lesson("4.1", "4.3") + lesson("4.2", "4.1") + lesson("4.3", "4.2"),
         "11:18-23 prerequisite-cycle: lessons require each other in a circle:"
         " 4.1 → 4.3 → 4.2 → 4.1 [remove one of these prerequisites]"),
        # pages
        (HEAD + '[[page]]\nid = "a"\ntitle = "A"\n',
         "3:1-9 field-missing: `file` is missing [`file`: its Markdown, relative to the project]"),
        (HEAD + '[[page]]\nid = "a"\ntitle = "A"\nfile = "../a.md"\n',
         f"6:8-17 field-value: `../a.md` leads out of its folder by `..` [{PATH}]"),
        (HEAD + '[[page]]\nid = "a"\ntitle = "A"\nfile = "/a.md"\n',
         f"6:8-15 field-value: `/a.md` is not relative to the project [{PATH}]"),
        (HEAD + '[[page]]\nid = "a"\ntitle = "A"\nfile = "C:/a.md"\n',
         f"6:8-17 field-value: `C:/a.md` is not relative to the project [{PATH}]"),
        (HEAD + "[[page]]\nid = \"a\"\ntitle = \"A\"\nfile = 'b\\a.md'\n",
         f"6:8-16 field-value: `b\\a.md` has a backslash: folders are separated by `/` [{PATH}]"),
        (HEAD + '[[page]]\nid = "a"\ntitle = "A"\nfile = "b//a.md"\n',
         f"6:8-17 field-value: `b//a.md` is not a plain path [{PATH}]"),
        (HEAD + '[[page]]\nid = "a"\ntitle = "A"\nfile = "a.txt"\n',
         f"6:8-15 field-value: `a.txt` is no Markdown file: its name ends in `.md` [{PATH}]"),
        (HEAD + '[[page]]\nid = "a"\ntitle = "A"\nfile = "a.md"\n'
         '[[page]]\nid = "a"\ntitle = "B"\nfile = "b.md"\n',
         "8:6-9 id-repeated: the page id `a` is used twice"),
        (HEAD + '[[page]]\nid = "a"\ntitle = "A"\nfile = "a.md"\n'
         '[[page]]\nid = "b"\ntitle = "B"\nfile = "a.md"\n',
         "10:8-14 field-value: two pages have the file `a.md`"),
        (HEAD + '[[page]]\nid = "a"\ntitle = 2024-01-01\nfile = "a.md"\n', "5:9-19 field-type:"
         ' `title` must be a string, not a date or time [put it between quotes: `"2024-01-01"`]'),
        # settings
        (HEAD + '[verify]\ncompare = "volatile"\n', "4:11-21 field-value: `compare` cannot be"
         " `volatile` [known: `digits`, `exact`, `rtol`]"),
        (HEAD + '[verify]\ncompare = "rtol"\n',
         '4:11-17 field-missing: `compare = "rtol"` needs `rtol` or `atol`'),
        (HEAD + '[verify]\ncompare = "exact"\natol = 1\n',
         '5:1-5 field-value: `atol` counts only with `compare = "rtol"`'),
        (HEAD + "[verify]\nrtol = inf\n",
         "4:8-11 field-value: `rtol` must be a finite number, not inf"),
        (HEAD + "[verify]\nrtol = nan\n",
         "4:8-11 field-value: `rtol` must be a finite number, not nan"),
        (HEAD + "[verify]\nrtol = -1e-3\n", "4:8-13 field-value: `rtol` must be at least 0,"
         " not -1e-3"),
        (HEAD + '[[verify.filter]]\npattern = "a(b"\nreplacement = ""\n', "4:13-14 field-value:"
         " the pattern does not compile: missing ), unterminated subpattern"),
        (HEAD + '[[verify.filter]]\npattern = "\\\\d[z-a]"\nreplacement = ""\n',
         "4:16-17 field-value: the pattern does not compile: bad character range z-a"),
        (HEAD + "[[verify.filter]]\npattern = 'a(b)'\nreplacement = 'x\\2'\n",
         "5:18-19 field-value: the replacement cannot be used: invalid group reference 2"),
        (HEAD + "[[verify.filter]]\npattern = 'a'\nreplacement = '\\g<n>'\n",
         "5:15-22 field-value: the replacement cannot be used: unknown group name 'n'"),
        (HEAD + '[[verify.filter]]\npattern = ""\nreplacement = ""\n',
         "4:11-13 field-value: `pattern` is empty"),
        (HEAD + '[callouts]\n"My kind" = "M"\n', "4:1-10 field-value: `My kind` cannot be a kind"
         " of callout [expected: lower-case letters and digits in words joined by single hyphens]"),
        (HEAD + "[callouts]\nlab = 3\n", "4:7-8 field-type: `lab` must be a string or a table,"
         ' not the number 3 [put it between quotes: `"3"`]'),
        (HEAD + '[callouts.lab]\nlable = "L"\n',
         "4:1-6 field-unknown: unknown field `lable` [did you mean `label`?]"),
        (HEAD + '[[silence]]\nrule = "heading-skp"\nreason = "r"\n', "4:8-21 silence-rule: there"
         " is no rule `heading-skp` [did you mean `heading-skip`?]"),
        (HEAD + '[[silence]]\nrule = "output-drift"\nreason = "r"\n', "4:8-22 silence-rule:"
         " `output-drift` is an error; only warnings can be silenced"),
        (HEAD + '[[silence]]\nrule = "heading-skip"\n', "3:1-12 silence-rule: the silence gives no"
         ' reason [say why: `reason = "…"`]'),
        (HEAD + '[[silence]]\nrule = "heading-skip"\nreason = " "\n', "5:10-13 silence-rule: the"
         ' silence gives no reason [say why: `reason = "…"`]'),
    ],
)  # fmt: skip
def test_what_an_author_is_told(text: str, expected: str) -> None:
    assert told(text) == [expected]
    # A course with these mistakes can still be read, so that those of its lessons are told as well.
    usable = ("prerequisite-", "stands in the level", "is named twice")
    assert (parse(text).value is None) is not any(part in expected for part in usable)


def test_a_mistake_in_a_lesson_does_not_make_it_unknown_to_others() -> None:
    text = LEVEL + lesson("4.1", status="done") + lesson("4.2", "4.1") + lesson("4.3", "4.2")
    assert [(d.rule, d.span.text) for d in parse(text).diagnostics] == [("field-value", '"done"')]
    unquoted = text.replace('"4.1"\nslug', "4.1\nslug").replace('"done"', '"planned"')
    assert [d.rule for d in parse(unquoted).diagnostics] == ["field-type"]


def test_everything_wrong_is_told_in_one_run_in_order() -> None:
    text = (
        HEAD
        + 'base_url = "x"\n[[level]]\nid = "4"\n'
        + lesson("4.1", "4.9", slug="S")
        + lesson("4.2", "4.9", "4.2")
        + '[[silence]]\nrule = "x-y-z"\n[[page]]\nid = "A"\ntitle = ""\nfile = "a"\n'
    )
    assert [line.split(" [")[0] for line in told(text)] == [
        "3:12-15 field-value: `base_url` cannot be `x`",
        "4:1-10 field-missing: `title` is missing",
        "8:8-11 field-value: `slug` cannot be `S`",
        "17:18-23 prerequisite-unknown: no lesson of the map has the id `4.9`",
        "17:25-30 prerequisite-cycle: lesson 4.2 requires itself",
        "18:1-12 silence-rule: the silence gives no reason",
        "19:8-15 silence-rule: there is no rule `x-y-z`",
        "21:6-9 field-value: `id` cannot be `A`",
        "22:9-11 field-value: `title` is empty",
    ]


def test_a_circle_points_at_each_of_its_steps() -> None:
    text = LEVEL + lesson("4.1", "4.3") + lesson("4.2", "4.1") + lesson("4.3", "4.2")
    (found,) = parse(text).diagnostics
    assert [(n.message, n.span and n.span.line) for n in found.notes] == [
        ("4.3 requires 4.2 here", 23),
        ("4.2 requires 4.1 here", 17),
    ]


def test_circles_are_found_once_and_in_order() -> None:
    graph = {
        "a": ["b"],
        "b": ["c", "d"],
        "c": ["a"],
        "d": ["b"],
        "e": ["a", "f"],
        "f": ["g"],
        "g": ["f"],
        "h": ["h"],
        "i": [],
    }
    assert circles(graph, list("abcdefghi")) == [["a", "b", "c"], ["f", "g"], ["h"]]
    assert circles(graph, list("ihgfedcba")) == [["h"], ["g", "f"], ["d", "b"]]


@settings(max_examples=200)
@given(
    st.integers(1, 8).flatmap(
        lambda n: st.lists(st.lists(st.integers(0, n - 1), max_size=3), min_size=n, max_size=n)
    )
)
def test_circles_are_circles_and_none_is_missed(edges: list[list[int]]) -> None:
    graph = {str(i): [str(t) for t in targets] for i, targets in enumerate(edges)}
    found = circles(graph, list(graph))
    for circle in found:
        steps = zip(circle, [*circle[1:], circle[0]], strict=True)
        assert all(after in graph[before] for before, after in steps)
        assert len(set(circle)) == len(circle)
    # without the lessons of the circles nothing goes round: take them out by their groups
    reach = {name: set(targets) for name, targets in graph.items()}
    for _ in graph:
        for name in graph:
            reach[name] |= {t for target in reach[name] for t in reach[target]}
    on_circles = {name for name in graph if name in reach[name]}
    groups = {
        frozenset(o for o in on_circles if o in reach[n] and n in reach[o]) for n in on_circles
    }
    assert {
        frozenset(o for o in on_circles if o in reach[c[0]] and c[0] in reach[o]) for c in found
    } == groups
    assert len(found) == len(groups)


@settings(max_examples=300)
@given(st.data())
def test_a_mutation_is_never_too_much(data: st.DataObject) -> None:
    at = data.draw(st.integers(0, len(COMPLETE)))
    piece = data.draw(
        st.sampled_from([*"[]{}=.,\"'\\\n#", "id = 4.2\n", "[[level]]\n", "[course]\n", "1", "\r"])
        | st.text(max_size=3)
    )
    mutated = COMPLETE[:at] + piece + COMPLETE[at + data.draw(st.integers(0, 20)) :]
    parsed = parse(mutated)
    assert parsed.value is not None or parsed.diagnostics
    orders = [d.order for d in parsed.diagnostics]
    assert orders == sorted(orders)
