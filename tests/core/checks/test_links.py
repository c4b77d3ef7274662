"""Links and mentions that `fixtures/rules` and `fixtures/mistakes` do not show."""

from __future__ import annotations

import pytest

from coursebuild.core.checks.lessons import check_course
from coursebuild.core.checks.links import anchors
from support.made_courses import BOX, document, make_course, messages, rules_and_texts

SCRIPT = "```python file=examples/a_b.py\nx = 1\nprint(x)\n```\n\nOutput:\n\n```text\n1\n```\n"
QUESTION = '{"id": "one", "kind": "open", "q": "Q", "reference": "R"}'
QUIZ = f'```quiz\n{{"id": "q1", "questions": [{QUESTION}]}}\n```\n'


def messages_of(first: str, second: str = f"## There {{#there}}\n\n{SCRIPT}") -> list[str]:
    files = ["content/lessons/plot.svg", "content/data/a b.csv"]
    return rules_and_texts(
        check_course(make_course(first, second, models={"box": BOX}, files=files))
    )


GOOD = (
    *("model:box#facts", "model:box#file", "model:box#box.xml", "model:box#box.L3", "#"),
    *("../lessons/plot.svg#x", "../data/a%20b.csv?x", "//example.org/x"),
    *("lesson:1.2#a_b.py", "lesson:1.2#a_b.L2", "lesson:1.2#a_b.L1-L2", "lesson:1.2#a_b.out"),
)
BAD = {
    "link-lesson": ("lesson:4.3#x",),
    "link-file": ("table.csv", "../plot.svg", "box.xml"),
    "link-anchor": (
        *("#nowhere", "#Here", "lesson:1.2#here", "lesson:1.3#x", "page:about#x"),
        *("1.2-second.md#x", "lesson:1.2#a_b.L3", "lesson:1.2#a_b.L2-L1", "lesson:1.2#a_b.out-2"),
        *("lesson:1.2#c.L1", "model:box#x", "model:box#box.L4", "model:box#bx.L1"),
        "model:box#box.L2-L4",
    ),
}


def test_links_that_lead_somewhere_are_good() -> None:
    assert messages_of("## Here\n\n" + "\n".join(f"[a]({target})" for target in GOOD)) == []


@pytest.mark.parametrize("rule", BAD)
def test_links_that_lead_nowhere_are_reported_at_their_targets(rule: str) -> None:
    messages = messages_of("## Here\n\n" + "\n".join(f"[a]({target})" for target in BAD[rule]))
    assert messages == [f"{rule}: {target}" for target in BAD[rule]]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("See Lessons 1.1, 1.2 and 1.9.\n", ["link-lesson: 1.9"]),
        ("> [!note] See Level 7\n> Text.\n", ["link-level: 7"]),
        ("| a |\n| - |\n| Lesson 4.3 |\n", ["link-lesson: 4.3"]),
        ("[a][r]\n\n[r]: lesson:4.3\n", ["link-lesson: lesson:4.3"]),
        (QUIZ.replace('"Q"', '"See Lesson 4.3."'), ["link-lesson: 4.3"]),
    ],
)
def test_mentions_are_links_wherever_they_stand(text: str, expected: list[str]) -> None:
    assert messages_of(text) == expected


def test_anchors_of_a_document() -> None:
    text = (
        "## A B {#a}\n\n"
        + SCRIPT
        + "Output:\n\n```text\n1\n```\n\n"
        + QUIZ
        + '\n$$\nx\n$$ {#eq:one}\n\n<div id="raw">\n</div>\n\nText <b id=in>b</b>'
        + " and [mass]{term}.\n"
    )
    spans = anchors(document("content/lessons/1.1-x.md", text))
    assert spans.keys() == {
        *("a", "a_b.py", "a_b.out", "a_b.out-2", "q1", "q1.one", "eq:one", "raw", "in", "term:mass")
    }
    assert [spans[id].text for id in ("a", "in", "term:mass")] == [
        *("## A B {#a}", "<b id=in>", "[mass]{term}")
    ]
    assert spans["eq:one"].start == text.index("$$")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[a](lesson:1.3#x)", "lesson 1.3 is planned, so it has no anchor `#x` yet"
         " [link to the lesson itself]"),
        ("[a](page:about#x)", "page `about` has no anchor `#x`"),
        ("[a](model:box#fact)", "the page of the model `box` has no anchor `#fact`"
         " [did you mean `facts`?]"),
        ("[a](x.md)", "no file `content/lessons/x.md`"
         " [link to a lesson by its id (`lesson:4.3`) and to a page by `page:about`]"),
        ("[a](box.xml)", "no file `content/lessons/box.xml`"
         " [link to a model by its name: `model:box`]"),
    ],
)  # fmt: skip
def test_the_message_says_why_a_link_leads_nowhere(text: str, message: str) -> None:
    assert messages(check_course(make_course(text, models={"box": BOX}))) == [message]
