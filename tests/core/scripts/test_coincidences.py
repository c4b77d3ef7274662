"""Lessons whose outputs are full of near-coincidences, after a parameter of their script changed.

Each quantity has a name of its own and a value of its own. Before and after the change others are
printed that are equal, near, or what the first ones were. After `update`, no shown value may be
that of another quantity: it is its own, or nothing was written and the check says so.
"""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Iterator

import pytest
from msgspec import Struct

from coursebuild.core.model import Document, Recording, find_blocks
from coursebuild.core.model.lesson_record import Addresses
from coursebuild.core.scripts.bindings import check_bindings, update_outputs
from coursebuild.core.scripts.bound_places import document_bindings
from coursebuild.core.scripts.compare import verify
from coursebuild.core.scripts.edit import apply_edits
from coursebuild.core.scripts.printed_outputs import PrintedOutputs
from coursebuild.core.scripts.table_cells import table_rows
from support.sample_lessons import course, document, make_run

PATH = "examples/a.py"


class World(Struct):
    """A generated script: what it printed before and after a change, and what its lesson shows."""

    before: list[str]
    now: list[str]
    lesson: str
    quantities: list[tuple[str, str]]
    """Of each bound number, in order, what it was and is."""
    rows: dict[str, tuple[list[str], list[str]]]
    """Likewise of the rows of the table, by their first cell."""


def plant(rng: random.Random, old: list[str], new: list[str]) -> str:
    """A value near, or equal to, one that is printed before or after."""
    value = rng.choice(old + new)
    return value if rng.random() < 0.7 else f"{float(value) + rng.choice((-0.001, 0.001)):.3f}"


def make_world(seed: int) -> World:
    rng = random.Random(seed)
    names = rng.sample("mass length period force angle speed work drag lift drift".split(), 5)
    cups = rng.sample("steel glass clay paper wood".split(), 3)
    old = [f"{rng.uniform(1, 99):.3f}" for _ in range(14)]
    new = [f"{rng.uniform(1, 99):.3f}" for _ in range(14)]
    if rng.random() < 0.5:  # what one quantity was, another is now
        new[rng.randrange(14)] = rng.choice(old)
    noise = [(plant(rng, old, new), plant(rng, old, new)) for _ in range(8)]

    def printed(values: list[str], side: int) -> list[str]:
        n = [pair[side] for pair in noise]
        return [
            f"quartiles {n[0]} {n[1]}",
            f"{cups[0]} {n[2]} {n[3]} {n[4]}",
            *(f"{name} = {value} m" for name, value in zip(names, values, strict=False)),
            f"{cups[1]} {n[5]} {n[6]} {n[7]}",
            *(
                f"{cup} T0 = {values[5 + 3 * i]} K  k = {values[6 + 3 * i]} Hz"
                f"  tau = {values[7 + 3 * i]} s"
                for i, cup in enumerate(cups)
            ),
        ]

    prose = " ".join(f'The {names[i]} is `{old[i]} m`{{out="{names[i]}"}}.' for i in range(3))
    prose += " " + " ".join(f"And {names[i]}: `{old[i]}`{{out}}." for i in range(3, 5))
    table = "| cup | T₀ (K) | k (Hz) | τ (s) |\n| --- | --- | --- | --- |\n" + "".join(
        f"| {cup} | {' | '.join(old[5 + 3 * i : 8 + 3 * i])} |\n" for i, cup in enumerate(cups[:2])
    )
    before, now = printed(old, 0), printed(new, 1)
    text = "\n".join(before)
    lesson = f"```python file={PATH}\nprint(1)\n```\n\n```output\n{text}\n```\n\n{prose}\n\n"
    lesson += f"Output, in short:\n\n{table}\n"
    quantities = [(old[i], new[i]) for i in range(5)]
    rows = {
        cup: (old[5 + 3 * i : 8 + 3 * i], new[5 + 3 * i : 8 + 3 * i])
        for i, cup in enumerate(cups[:2])
    }
    return World(before, now, lesson, quantities, rows)


def outputs_of(page: Document, lines: list[str], addresses: Addresses) -> PrintedOutputs:
    runs = [make_run("\n".join(lines) + "\n")]
    return PrintedOutputs(verify(course(page), runs, addresses), runs, [PATH])


def update(page: Document, lines: list[str], addresses: Addresses) -> tuple[Document, int]:
    """The lesson as `update` leaves it, and how many of its outputs were refused."""
    outputs = outputs_of(page, lines, addresses)
    edits, refusals = update_outputs(outputs.of_document(page), [page], outputs, addresses)
    return document(apply_edits(page.source.text, edits)), len(refusals)


def shown_rows(page: Document) -> Iterator[list[str]]:
    for recording in find_blocks(page, Recording):
        if not hasattr(recording.body, "rows"):
            continue
        for row in table_rows(recording.body):
            yield [cell.mapped.text for cell in row]


@pytest.mark.parametrize("seeds", [range(60), pytest.param(range(1000), marks=pytest.mark.slow)])
def test_no_value_ever_comes_from_another_quantity(seeds: range) -> None:
    counts: Counter[str] = Counter()
    mistakes: list[str] = []
    for seed in seeds:
        world, addresses = make_world(seed), Addresses()
        page = document(world.lesson)
        check_bindings(page, outputs_of(page, world.before, addresses), addresses)
        if seed % 2:  # a clone in which nothing is remembered
            addresses = {}
        new_page, refused = update(page, world.now, addresses)
        counts["refused outputs"] += refused
        diagnostics = check_bindings(
            new_page, outputs_of(new_page, world.now, addresses), addresses
        )
        told_places = {diagnostic.span for diagnostic in diagnostics}
        bindings = document_bindings(new_page)
        for binding, (old, new) in zip(bindings, world.quantities, strict=True):
            text = binding.text.removesuffix(" m")
            counts["followed" if text == new else "left"] += 1
            is_told = text == old and binding.text_span in told_places
            mistakes += [] if text == new or is_told else [f"{seed}: {text} for {new}, was {old}"]
        for name, *values in shown_rows(new_page):
            old_row, new_row = world.rows[name]
            counts["rows followed" if values == new_row else "rows left"] += 1
            mistakes += [] if values in (old_row, new_row) else [f"{seed}: {name} {values}"]
    assert mistakes == []
    assert (counts["rows left"], counts["refused outputs"]) == (0, 0), counts
    assert counts["left"] < counts["followed"] / 5, counts  # those that were printed at two places
