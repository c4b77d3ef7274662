"""Links, mentions and images: each leads somewhere."""

from __future__ import annotations

import pytest

from coursebuild.core.checks.course import check_course
from coursebuild.core.checks.links import anchors
from support.made_courses import BOX, document, make_course, said, told

SCRIPT = "```python file=examples/a_b.py\nx = 1\nprint(x)\n```\n\nOutput:\n\n```text\n1\n```\n"
QUESTION = '{"id": "one", "kind": "open", "q": "Q", "reference": "R"}'
QUIZ = f'```quiz\n{{"id": "q1", "questions": [{QUESTION}]}}\n```\n'


def findings(first: str, second: str = f"## There {{#there}}\n\n{SCRIPT}") -> list[str]:
    files = ["content/lessons/plot.svg", "content/data/a b.csv"]
    return told(check_course(make_course(first, second, models={"box": BOX}, files=files)))


@pytest.mark.parametrize(
    "target",
    [
        *("lesson:1.2", "lesson:1.2#there", "lesson:1.3", "page:about", "model:box"),
        *("model:box#facts", "model:box#file", "model:box#box.xml", "model:box#box.L3"),
        *("model:box#box.L1-L3", "examples/a_b.py", "#here", "#", "1.2-second.md#there"),
        *("plot.svg", "../lessons/plot.svg#x", "/content/lessons/plot.svg", "../data/a%20b.csv?x"),
        *("https://example.org/x#y", "mailto:a@example.org", "//example.org/x"),
        *("lesson:1.2#a_b.py", "lesson:1.2#a_b.L2", "lesson:1.2#a_b.L1-L2", "lesson:1.2#a_b.out"),
    ],
)
def test_a_link_that_leads_somewhere_is_good(target: str) -> None:
    assert findings(f"## Here\n\n[a]({target})\n") == []


@pytest.mark.parametrize(
    ("target", "rule"),
    [
        *(("lesson:4.3", "link-lesson"), ("lesson:4.3#x", "link-lesson")),
        *(("page:abut", "link-page"), ("model:bx", "link-model"), ("term:mass", "link-term")),
        *(("examples/ab.py", "link-example"), ("table.csv", "link-file")),
        *(("1.2-scond.md", "link-file"), ("../plot.svg", "link-file"), ("box.xml", "link-file")),
        *(("#nowhere", "link-anchor"), ("#Here", "link-anchor")),
        *(("lesson:1.2#here", "link-anchor"), ("lesson:1.3#x", "link-anchor")),
        *(("page:about#x", "link-anchor"), ("1.2-second.md#x", "link-anchor")),
        *(("lesson:1.2#a_b.L3", "link-anchor"), ("lesson:1.2#a_b.L2-L1", "link-anchor")),
        *(("lesson:1.2#a_b.out-2", "link-anchor"), ("lesson:1.2#c.L1", "link-anchor")),
        *(("model:box#x", "link-anchor"), ("model:box#box.L4", "link-anchor")),
        *(("model:box#bx.L1", "link-anchor"), ("model:box#box.L2-L4", "link-anchor")),
    ],
)
def test_a_link_that_leads_nowhere_is_told_at_its_target(target: str, rule: str) -> None:
    assert findings(f"## Here\n\n[a]({target})\n") == [f"{rule}: {target}"]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("See Lesson 4.3 and Level 7.\n", ["link-lesson: 4.3", "link-level: 7"]),
        ("See Lessons 1.1, 1.2 and 1.9.\n", ["link-lesson: 1.9"]),
        ("See Lesson 1.2 and Level 1, and `Lesson 9.9`.\n", []),
        ("> [!note] See Level 7\n> Text.\n", ["link-level: 7"]),
        ("| a |\n| - |\n| Lesson 4.3 |\n", ["link-lesson: 4.3"]),
        ("[a][r]\n\n[r]: lesson:4.3\n", ["link-lesson: lesson:4.3"]),
        (QUIZ.replace('"Q"', '"See Lesson 4.3."'), ["link-lesson: 4.3"]),
    ],
)
def test_mentions_are_links_wherever_they_stand(text: str, expected: list[str]) -> None:
    assert findings(text) == expected


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ('See <a href="#nowhere">it</a>.\n', ["link-anchor: #nowhere"]),
        ("<p>See <a class=x HREF=#nowhere>it</a></p>\n", ["link-anchor: #nowhere"]),
        ('<a id="here"></a> <a href="#here">it</a> [b](#here)\n', []),
        ("<p id=here>A</p>\n\n[b](#here)\n", []),
        ('See <a href="https://example.org/#x">it</a>.\n', []),
    ],
)
def test_links_in_raw_html_to_this_page_are_checked(text: str, expected: list[str]) -> None:
    assert findings(text) == expected


def test_each_thing_of_a_document_that_has_an_anchor_is_known_by_it() -> None:
    text = (
        "## A B {#a}\n\n"
        + SCRIPT
        + "Output:\n\n```text\n1\n```\n\n"
        + QUIZ
        + '\n$$\nx\n$$ {#eq:one}\n\n<div id="raw">\n</div>\n\nText <b id=in>b</b>'
        + " and [mass]{term}.\n"
    )
    known = anchors(document("content/lessons/1.1-x.md", text))
    assert known.keys() == {
        *("a", "a_b.py", "a_b.out", "a_b.out-2", "q1", "q1.one", "eq:one", "raw", "in", "term:mass")
    }
    assert [known[id].text for id in ("a", "in", "term:mass")] == [
        *("## A B {#a}", "<b id=in>", "[mass]{term}")
    ]
    assert known["eq:one"].start == text.index("$$")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("Lesson 4.3", "lesson 4.3 is mentioned, and the course map does not have it"
         " [known: `1.1`, `1.2`, `1.3`]"),
        ("[a](lesson:1.4)", "lesson 1.4 is linked to, and the course map does not have it"
         " [level 1 has `1.1`, `1.2`, `1.3`]"),
        ("[a](lesson:1.3#x)", "lesson 1.3 is planned, so it has no anchor `#x` yet"
         " [link to the lesson itself]"),
        ("[a](lesson:1.2#a_b.L3)", "lesson 1.2 has no anchor `#a_b.L3`"
         " [the last line of `examples/a_b.py` is 2]"),
        ("[a](page:about#x)", "page `about` has no anchor `#x`"),
        ("[a](model:box#box.L9)", "the page of the model `box` has no anchor `#box.L9`"
         " [the last line of `models/box.xml` is 3]"),
        ("[a](model:box#fact)", "the page of the model `box` has no anchor `#fact`"
         " [did you mean `facts`?]"),
        ("[a](x.md)", "no file `content/lessons/x.md`"
         " [link to a lesson by its id (`lesson:4.3`) and to a page by `page:about`]"),
        ("[a](box.xml)", "no file `content/lessons/box.xml`"
         " [link to a model by its name: `model:box`]"),
        ("[a](plt.svg)", "no file `content/lessons/plt.svg`"
         " [did you mean `content/lessons/plot.svg`?]"),
    ],
)  # fmt: skip
def test_what_is_said_of_a_link_fits_why_it_leads_nowhere(text: str, message: str) -> None:
    files = ["content/lessons/plot.svg"]
    course = make_course(text, SCRIPT, models={"box": BOX}, files=files)
    assert said(check_course(course)) == [message]


def test_declared_scenarios_have_anchors_on_the_page_of_their_model() -> None:
    declared = {"box": '[[scenario]]\nname = "swing"\n'}
    good, bad = "model:box#measured-swing", "model:box#measured-start"
    text = f"[a]({good}) [b]({bad})\n"
    course = make_course(text, models={"box": BOX}, declared=declared)
    assert told(check_course(course)) == [f"link-anchor: {bad}"]
    assert told(check_course(make_course(text, models={"box": BOX}))) == [
        f"link-anchor: {good}",
        f"link-anchor: {bad}",
    ]
