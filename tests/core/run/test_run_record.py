"""Records of runs: there and back, moved to another machine, and whatever else JSON may hold."""

from __future__ import annotations

import json

from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

from coursebuild.core.model.results import Divergence, Outcome, Sign
from coursebuild.core.run.dependencies import Dependency, Inputs, Kind
from coursebuild.core.run.run_record import RunRecord, from_bytes, to_bytes

HERE = (("course", "/home/me/course"), ("prefix", "/opt/venv"), ("home", "/home/me"))
THERE = (("course", "/ci/build"), ("prefix", "/usr"), ("home", "/root"))
INPUTS = Inputs("examples/a.py", "0" * 64, (), 10.0, (), (("Python", "3.11"),))
RECORD = RunRecord(INPUTS, (), Outcome.OK, 0, 0.25, 1_700_000_000, "", "out\n", "")

text = st.text(st.characters(codec="utf-8"), max_size=20)
names = st.text(max_size=8)  # lone surrogates too: bytes of names that are no text
dependencies = st.builds(Dependency, st.sampled_from(Kind), names, names)
inputs = st.builds(
    Inputs,
    names,
    names,
    st.lists(text, max_size=2).map(tuple),
    st.floats(0.001, 1e6),
    st.lists(text, max_size=2).map(tuple),
    st.lists(st.tuples(text, text), max_size=2).map(tuple),
)
divergences = st.builds(
    Divergence,
    st.sampled_from(Sign),
    text,
    text,
    text,
    st.integers(0, 1 << 20),
    text,
    st.lists(text, max_size=2).map(tuple),
)
records = st.builds(
    RunRecord,
    inputs,
    st.lists(dependencies, max_size=3).map(tuple),
    st.sampled_from(Outcome),
    st.integers(-64, 255),
    st.floats(0, 1e5).map(lambda seconds: round(seconds, 4)),
    st.integers(0, 1 << 40),
    text,
    text,
    text.map(lambda value: value.replace("\0", "")),
    st.lists(divergences, max_size=2).map(tuple),
)


@given(records)
def test_there_and_back(record: RunRecord) -> None:
    found = from_bytes(to_bytes(record, ()))
    assert found == record


@given(st.binary(max_size=200))
def test_whatever_bytes_there_are(data: bytes) -> None:
    assert from_bytes(data) is None


@given(st.data())
def test_json_that_is_no_record(data: st.DataObject) -> None:
    value = json.loads(to_bytes(RECORD, ()))
    name = data.draw(st.sampled_from(sorted(value)))
    wrong = st.sampled_from([None, {}, [[]], {"a": 1}, [1]])
    value[name] = data.draw(wrong)
    assert from_bytes(json.dumps(value).encode()) is None
    if name not in ("stdout", "stderr", "divergences", "moved", "states", "figures"):
        del value[name]
        assert from_bytes(json.dumps(value).encode()) is None


def test_a_traceback_is_moved_to_another_machine() -> None:
    stderr = (
        'File "/home/me/course/examples/a.py", line 2\n'
        'File "/opt/venv/lib/python3.11/site-packages/numpy/x.py", line 3\n'
        "/home/me/course/examples/a.py:3: UserWarning: ~ is /home/me and /home/mexico\n"
        "a/home/me/course stays, /home/me/courses is in the home folder\n"
    )
    record = replace(RECORD, outcome=Outcome.FAILED, status=1, stderr=stderr)
    kept = to_bytes(record, HERE)
    assert b"/home/me/course/" not in kept and b"/opt/venv" not in kept
    found = from_bytes(kept)
    assert found is not None
    assert found.run(HERE).stderr == stderr
    assert found.run(THERE).stderr == (
        'File "/ci/build/examples/a.py", line 2\n'
        'File "/usr/lib/python3.11/site-packages/numpy/x.py", line 3\n'
        "/ci/build/examples/a.py:3: UserWarning: ~ is /root and /home/mexico\n"
        "a/home/me/course stays, /root/courses is in the home folder\n"
    )
