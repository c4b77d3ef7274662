"""Everything that can be wrong in a course map."""

from __future__ import annotations

import pytest

from support.course_maps import HEAD, LEVEL, lesson, parse, told

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
        (HEAD + "licence =", '3:10-10 map-syntax: a value is missing'
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


def test_circles_of_other_lessons_are_reported_in_the_same_run() -> None:
    pairs = [("4.1", "4.2"), ("4.2", "4.1"), ("4.3", "4.1"), ("4.4", "4.4")]
    found = parse(LEVEL + "".join(lesson(*pair) for pair in pairs)).diagnostics
    assert [d.message for d in found] == [
        "lessons require each other in a circle: 4.1 → 4.2 → 4.1",
        "lesson 4.4 requires itself",
    ]
