"""The course of the tests of a reader's progress: two levels, quizzes, and a page with one."""

from __future__ import annotations

import json
from collections.abc import Mapping

MAP = """[course]
title = "Motion & <i>rest</i>"
id = "motion"
summary = "A small course."

[[page]]
id = "about"
title = "About"
file = "content/pages/about.md"

[[level]]
id = "1"
title = "First <b>steps</b> & more"

[[level.lesson]]
id = "1.1"
slug = "push"
title = "Push & <em>pull</em>"
status = "complete"
minutes = 20

[[level.lesson]]
id = "1.2"
slug = "fall"
title = "Free fall, from a height that is not small"
status = "complete"
minutes = 35
prerequisites = ["1.1"]

[[level.lesson]]
id = "1.3"
slug = "orbit"
title = "Orbits"
status = "planned"

[[level]]
id = "2"
title = "Later"

[[level.lesson]]
id = "2.1"
slug = "spin"
title = "Spin"
status = "draft"
"""


def quiz(id: str, *questions: Mapping[str, object], title: str = "Check") -> str:
    """A fence."""
    text = json.dumps({"id": id, "title": title, "questions": questions}, indent=1)
    return f"```quiz\n{text}\n```\n\n"


def choice(q: str, **more: object) -> dict[str, object]:
    """A question whose right answer is the second."""
    return {"kind": "mcq", "q": q, "options": ["Up", "Down", "Nowhere"], "answer": 1, **more}


PARAGRAPH = "A body stays at rest or moves on evenly where nothing acts on it. " * 12

PUSH = f"""## Forces {{#forces}}

{PARAGRAPH}

{PARAGRAPH}

## The $x^2$ law & <i>its</i> reach {{#law}}

{PARAGRAPH}

{PARAGRAPH}

{PARAGRAPH}

## Questions {{#questions}}

""" + quiz(
    "push.check_1",
    choice("Where does a stone go?", explain="Down, see [the law](#law)."),
    {
        "kind": "numeric",
        "q": "How much is $2\\cdot 2$?",
        "answer": 4,
        "unit": "N",
        "hints": ["Add."],
    },
    choice("Where does smoke go?", id="smoke", answer=0),
)

FALL = f"""## Falling

{PARAGRAPH}

![A stone](stone.svg)

""" + quiz(
    "fall",
    choice("Which way is it? ![A stone](stone.svg)", id="way", explain="See [before](lesson:1.1)."),
    {
        "kind": "predict",
        "id": "swing",
        "q": "Where does the arm swing?",
        "options": ["Left", "Right"],
        "answer": 0,
        "sim": {"title": "Swing", "model": "pendulum", "key": "up", "stopAt": 0.1},
    },
    {"kind": "open", "id": "why", "q": "Why?", "reference": "Because of its weight."},
    {"kind": "order", "id": "steps", "q": "Order these.", "items": ["one", "two", "three"]},
)

FILES = {
    "content/course.toml": MAP,
    "content/lessons/1.1-push.md": PUSH,
    "content/lessons/1.2-fall.md": FALL,
    "content/lessons/2.1-spin.md": "## Spin\n\nIt spins.\n",
    "content/lessons/stone.svg": '<svg xmlns="http://www.w3.org/2000/svg" width="9" height="9"/>',
    "content/pages/about.md": "## What it is\n\n" + quiz("about", choice("Which?", id="which")),
}
