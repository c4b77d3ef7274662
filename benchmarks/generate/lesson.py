"""The pieces of one lesson, about 15 kB of them.

Entry point: `make_lesson`. A lesson has five sections, 25 formulas or a few more, ten of them
displayed, four callouts, a script with its output, tables, a list, a quiz and links to its
neighbours.
"""

from __future__ import annotations

import functools
import math
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.generate.document import Callout, InOut, Lesson, Piece, Question, Quiz, Script
from benchmarks.generate.scripts import duration_of, make_script, step_counts
from benchmarks.generate.topics import Fill, Topic, all_topics, pick, topic_of

LEVEL_SIZE = 10
"""Lessons in a level."""
COSTS = """| method | evaluations a step | order | error when the step is halved |
| --- | --- | --- | --- |
| Euler | 1 | 1 | a half |
| Heun | 2 | 2 | a quarter |
| midpoint | 2 | 2 | a quarter |
| Runge–Kutta | 4 | 4 | a sixteenth |"""


@functools.cache
def shared_texts() -> dict[str, Any]:
    """The texts that all lessons share, in variants."""
    return tomllib.loads(Path(__file__).with_name("methods.toml").read_text(encoding="utf-8"))


def lesson_id(number: int) -> str:
    """The id of a lesson, from its number."""
    return f"{number // LEVEL_SIZE + 1}.{number % LEVEL_SIZE + 1}"


def lesson_slug(number: int) -> str:
    """The slug of a lesson, from its number."""
    topics = all_topics()
    return f"{topics[number % len(topics)]['slug']}-{number // len(topics) + 1}"


def lesson_name(number: int) -> str:
    """The name of a lesson's file, without the ending."""
    return f"{lesson_id(number)}-{lesson_slug(number)}"


@dataclass(frozen=True, slots=True)
class Writer:
    """Chooses and fills the texts of one lesson."""

    number: int
    topic: Topic
    values: dict[str, str]

    def say(self, key: str) -> str:
        """One variant of a text that all lessons share."""
        variants = shared_texts()[key]
        return self.fill(variants[pick(self.number, key, len(variants))])

    def fill(self, text: str) -> str:
        """The text with the numbers of the run in it."""
        return Fill(text).substitute(self.values)

    def shared_formula(self, index: int) -> str:
        """A displayed formula that all lessons share, but for its numbers."""
        return display(self.fill(shared_texts()["displays"][index]))

    def topic_formula(self, name: str) -> str:
        """A displayed formula of the topic."""
        return display(self.topic.text("formulas", name))


def display(tex: str) -> str:
    """A formula on lines of its own."""
    return f"$$\n{tex}\n$$"


def make_lesson(number: int, count: int, scripts: str = "python") -> Lesson:
    """A lesson of a course that has `count` of them; it depends on nothing else."""
    topic = topic_of(number)
    steps = step_counts(number, 30)
    far = (number + len(all_topics())) % count
    writer = Writer(
        number,
        topic,
        {
            "T": duration_of(number),
            "N": str(steps[0]),
            "N2": str(steps[1]),
            "N4": str(steps[2]),
            "before": lesson_id(max(number - 1, 0)),
            "after": lesson_id(min(number + 1, count - 1)),
            "far": lesson_id(far),
        },
    )
    title = f"{topic.raw('title')}, case {number // len(all_topics()) + 1}"
    script = make_script(number, topic, topic.raw("title"), scripts)
    return Lesson(
        number,
        lesson_id(number),
        lesson_slug(number),
        title,
        topic.raw("summary"),
        (lesson_id(number - 1),) if number % LEVEL_SIZE else (),
        (
            *concept(writer),
            *mathematics(writer),
            *implementation(writer, script),
            *end(writer, script),
        ),
    )


def concept(writer: Writer) -> tuple[Piece, ...]:
    """The problem and its numbers."""
    first, second = writer.topic.texts("text", "intro")
    rows = "\n".join(f"| {name} | {value} |" for name, value in writer.topic.values.items())
    return (
        "## Core concept",
        first,
        writer.topic_formula("equation"),
        second,
        writer.say("intro"),
        f"| constant | value |\n| --- | --- |\n{rows}\n| duration | {writer.values['T']} |",
        Callout("established", "What is compared", False, writer.say("established")),
    )


def mathematics(writer: Writer) -> tuple[Piece, ...]:
    """The solution, and what is known about the methods."""
    topic = writer.topic
    origin = (
        *("Separate what depends on the time:", writer.topic_formula("derivation")),
        *("A case that can be checked by hand is", writer.topic_formula("special")),
    )
    second = 2 + 6 * pick(writer.number, "second formula", 2)
    return (
        "## Mathematics",
        "### The solution in closed form",
        *topic.texts("text", "model"),
        writer.topic_formula("solution"),
        Callout("derivation", "Where it comes from", True, "\n\n".join(origin)),
        "One more identity holds for every solution, and each method can be held to it:",
        writer.topic_formula("balance"),
        "### Four methods",
        writer.say("steps"),
        writer.shared_formula(0),
        writer.say("heun"),
        writer.say("rk4"),
        writer.shared_formula((1, 8)[pick(writer.number, "tableau", 2)]),
        "### Errors and orders",
        writer.say("local"),
        writer.shared_formula((3, 4, 9)[pick(writer.number, "bound", 3)]),
        writer.say("whole"),
        writer.say("order"),
        writer.shared_formula(5),
        writer.say("region"),
        writer.shared_formula((6, second)[pick(writer.number, "last formula", 2)]),
        "### Cost",
        COSTS,
        writer.say("cost"),
    )


def implementation(writer: Writer, script: Script) -> tuple[Piece, ...]:
    """The script, its output, and what it shows."""
    lines = script.output.splitlines()
    first = next(word for line in lines for word in line.split() if is_decimal(word))
    remark = f"The first number that the script prints is `{first}`{{out}}."
    return (
        "## Implementation",
        InOut(*shared_texts()["io"]),
        Callout("implementation", "How it is built", False, writer.say("implementation")),
        script,
        f"{remark} {writer.topic.text('text', 'close')}",
        writer.say("units"),
        writer.say("reading"),
        writer.say("discuss"),
        Callout("warning", "Before you trust a step", False, writer.say("warning")),
    )


def is_decimal(word: str) -> bool:
    """Whether a word of the output is a number with a decimal point."""
    return word.removeprefix("-").replace(".", "", 1).isdigit() and "." in word


def end(writer: Writer, script: Script) -> tuple[Piece, ...]:
    """A summary, the quiz, and where to go from here."""
    points = shared_texts()["points"]
    first = pick(writer.number, "points", len(points))
    selection = [points[(first + i) % len(points)] for i in range(4)]
    return (
        "## Summary",
        "\n".join(f"- {point}" for point in selection),
        f"**To try.** {writer.say('try')}",
        "## Check",
        Quiz(questions(writer, script.output.splitlines()[0], script.path)),
        "## Where to go from here",
        writer.say("links"),
    )


def questions(writer: Writer, first_line: str, script: str) -> tuple[Question, ...]:
    """Four questions; the last is about the output of a script."""
    topic = writer.topic
    numbers = {name: float(value) for name, value in topic.values.items()}
    value = float(f"{eval(topic.raw('quiz', 'value'), {'math': math}, numbers):.4g}")
    options, number = topic.texts("quiz", "options"), topic.raw("quiz", "answer")
    explain, number_explain = topic.text("quiz", "explain"), topic.text("quiz", "number_explain")
    choice = {"q": topic.text("quiz", "question"), "options": options, "answer": number}
    quantity = {"q": topic.text("quiz", "number"), "answer": value, "explain": number_explain}
    reference = topic.text("quiz", "reference")
    text = "The script is run again without any change. What is its first line?"
    return (
        Question({"kind": "mcq", **choice, "explain": explain}, f"{options[number]}. {explain}"),
        Question({"kind": "numeric", **quantity}, f"{value:g}. {number_explain}"),
        Question(
            {"kind": "open", "q": topic.text("quiz", "open"), "reference": reference}, reference
        ),
        Question({"kind": "output", "q": text, "of": script, "line": 1}, f"`{first_line}`"),
    )
