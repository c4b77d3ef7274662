"""What records of pages say together is the same, however they are put into groups."""

from __future__ import annotations

import pickle
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from markupsafe import Markup

from coursebuild.effects.aside import Aside
from coursebuild.pipeline.page_facts import Facts, Gathered, pack, unpack
from coursebuild.render.draft import Draft
from coursebuild.render.record import PageRecord

PATHS = st.sampled_from([f"lessons/{n}.html" for n in range(4)])
IDS = st.sampled_from(["", "top", "a", "b", "é"])


@st.composite
def records(draw: st.DrawFn) -> PageRecord:
    path = draw(PATHS)
    draft = Draft(
        path=path,
        title=draw(st.text(max_size=3)),
        kind=draw(st.sampled_from(["lesson", "page"])),
        description="",
        indexed=draw(st.booleans()),
        body=Markup(),
    )
    return PageRecord(
        draft,
        (),
        draw(st.text(max_size=5)),
        draw(st.text(max_size=3)),
        tuple(draw(st.lists(st.text(max_size=3), max_size=2))),
        tuple(sorted(draw(st.sets(IDS)))),
        tuple(sorted(draw(st.sets(st.tuples(PATHS, IDS))))),
        draw(st.none() | st.tuples(st.text(max_size=3), st.text(max_size=3))),
    )


def all_of(facts: Facts) -> tuple[object, ...]:
    return facts.together(), facts.sound, set(facts.leads), facts.anchors


@given(st.lists(records(), max_size=6), st.integers(0, 6))
def test_groups_say_together_what_their_records_say(said: list[PageRecord], cut: int) -> None:
    alone, together = Facts(), Facts()
    for record in said:
        alone.add(record)
    for part in (said[:cut], said[cut:]):
        gathered = Gathered.of(part)
        again = unpack(pack(gathered), len(part))
        assert again == gathered
        together.update(again)
    assert all_of(together) == all_of(alone)


@given(st.lists(records(), max_size=4))
def test_what_is_held_of_a_page_is_in_its_record(said: list[PageRecord]) -> None:
    aside = Aside(Path("/nowhere/at/all"))
    known = tuple(Gathered.of(said).known(aside))
    assert [one.ids for one in known] == [frozenset(record.ids) for record in said]
    assert [one.indexed for one in known] == [record.draft.indexed for record in said]
    for one, record in zip(known, said, strict=True):
        if record.search is None:
            assert one.entry is None
        else:
            draft, entry = record.draft, one.entry
            assert entry is not None
            assert (entry.path, entry.kind, entry.title) == (draft.path, draft.kind, draft.title)
            assert (entry.name, entry.digest) == record.search


@pytest.mark.parametrize("data", [None, b"", b"x", pickle.dumps(1)])
def test_what_is_no_group_is_none(data: bytes | None) -> None:
    assert unpack(data, 0) is None


def test_a_group_of_other_pages_is_none() -> None:
    assert unpack(pack(Gathered.of([])), 1) is None
