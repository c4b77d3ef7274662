"""Work divided among machines: everything is done exactly once."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coursebuild.pipeline.options import UsageError
from coursebuild.pipeline.shards import read_shard, read_timings, split, write_timings
from support.scratch_course import Make, block

names = st.lists(st.text(max_size=6), max_size=30)
times = st.dictionaries(st.text(max_size=6), st.floats(0, 1e6), max_size=20)


@settings(max_examples=40)
@given(names, st.integers(1, 12), times)
def test_every_name_is_in_exactly_one_part(
    names: list[str], count: int, seconds: dict[str, float]
) -> None:
    parts = split(names, count, seconds)
    assert set(parts) == set(names)
    assert set(parts.values()) <= set(range(1, count + 1))
    assert split(list(reversed(names)), count, dict(reversed(seconds.items()))) == parts
    alike = list(split(names, count, {}).values())  # without times, all parts are equally large
    sizes = [alike.count(part) for part in range(1, count + 1)]
    assert max(sizes) - min(sizes) <= 1


@given(st.dictionaries(st.text(max_size=6), st.integers(1, 1000), min_size=1), st.integers(1, 8))
def test_with_times_no_part_is_much_longer_than_it_must_be(
    seconds: dict[str, int], count: int
) -> None:
    parts = split(seconds, count, seconds)
    loads = [sum(seconds[n] for n in parts if parts[n] == p) for p in range(1, count + 1)]
    longest = max(seconds.values())
    assert max(loads) <= sum(seconds.values()) / count + (1 - 1 / count) * longest + 1e-9


def test_parts_take_equally_long_and_a_name_without_a_time_counts_as_the_usual_one() -> None:
    parts = split("abcd", 2, {"a": 9.0, "b": 3.0, "c": 3.0, "d": 3.0})
    assert [name for name in "abcd" if parts[name] == parts["a"]] == ["a"]
    parts = split(["a", "b", "new"], 2, {"a": 10.0, "b": 1.0})
    assert parts["b"] != parts["a"]
    assert parts["new"] != parts["a"] or parts["b"] != parts["new"]


def test_wrong_shard_argument_is_wrong_usage() -> None:
    for text in "1 / 0/2 3/2 1/0 -1/2 1/2/3 a/b 1/99999 ²/3".split():
        with pytest.raises(UsageError, match=r"^--shard: "):
            read_shard(text, [])
    assert read_shard(None, []) is None


def test_file_that_holds_no_timings_is_refused_and_kept(tmp_path: Path) -> None:
    file = tmp_path / "times.json"
    for data in (
        b"",
        b"\xff",
        b"[]",
        b"{}",
        b'{"seconds": []}',
        b'{"seconds": {"a": "1"}}',
        b'{"seconds": {"a": true}}',
        b'{"seconds": {"a": -1}}',
        b'{"seconds": {"a": NaN}}',
        b'{"seconds": {"a": 1e400}}',
        b"[" * 99999,
    ):
        file.write_bytes(data)
        with pytest.raises(UsageError) as caught:
            read_timings(str(file))
        message = f"--timings: {file} holds no times; `--write-timings` writes such a file"
        assert str(caught.value) == message
        with pytest.raises(UsageError):
            write_timings(str(file), {"a": 1.0}, ["a"])
        assert file.read_bytes() == data, "what somebody else put there stays"


def test_timings_that_cannot_be_read_or_written_are_told(tmp_path: Path) -> None:
    with pytest.raises(UsageError) as caught:
        read_timings(str(tmp_path / "none.json"))
    message = f"--timings: {tmp_path}/none.json cannot be read: no such file or directory"
    assert str(caught.value) == message
    (tmp_path / "file").write_text("")
    with pytest.raises(UsageError, match=r"^--write-timings: "):
        write_timings(str(tmp_path / "file/times.json"), {"a": 1.0}, ["a"])


def test_times_are_written_sorted_and_merged(tmp_path: Path) -> None:
    first_file, second_file = tmp_path / "1.json", tmp_path / "2.json"
    write_timings(str(first_file), {"b": 2.00049, "a": 1.0, "old": 3.0}, ["a", "b", "old"])
    write_timings(str(first_file), {"b": 5.0}, ["a", "b"])
    assert json.loads(first_file.read_bytes()) == {"seconds": {"a": 1.0, "b": 5.0}}
    assert first_file.read_bytes().startswith(b'{\n  "seconds": {\n    "a": 1.0,')
    assert read_timings(str(first_file)) == {"a": 1.0, "b": 5.0}
    write_timings(str(second_file), {"b": 2.0, "c": 3.0}, ["b", "c"])
    first = read_shard("1/2", [str(first_file), str(second_file)])
    assert first == read_shard("1/2", [str(second_file), str(first_file)])
    assert first is not None and dict(first.seconds) == {"a": 1.0, "b": 5.0, "c": 3.0}


# --- the command

LESSON = "## A\n\n" + "".join(
    block(f"s{number}.py", f"print({number})\n", str(number)) for number in range(5)
)


@pytest.mark.site
def test_all_parts_together_are_the_course(make: Make) -> None:
    folder = make(LESSON + block("bad.py", "print(1)\n", "2"))
    times = folder.root / "times.json"
    assert folder.main("check", "--write-timings", str(times)).status == 1
    all_paths = ["examples/bad.py", *(f"examples/s{number}.py" for number in range(5))]
    assert sorted(read_timings(str(times))) == all_paths
    for options in ([], ["--timings", str(times)]):
        paths: list[str] = []
        for part in (1, 2, 3):
            result = folder.main("check", "--shard", f"{part}/3", "--format", "json", *options)
            scripts = [script["path"] for script in json.loads(result.out)["scripts"]]
            assert result.status == ("examples/bad.py" in scripts), (
                "its mistake is told there alone"
            )
            paths += scripts
        assert sorted(paths) == all_paths


@pytest.mark.site
def test_a_part_with_nothing_to_do_is_no_mistake(make: Make) -> None:
    folder = make("## A\n\n" + block("a.py", "print(1)\n", "1"))
    reports = [folder.main("check", "--shard", f"{part}/3") for part in (1, 2, 3)]
    assert [result.status for result in reports] == [0, 0, 0]
    ends = sorted(result.out.splitlines()[-1] for result in reports)
    assert [end for end in ends if "0 scripts run" in end] == ends[:2]
    assert reports[0].out.endswith(": part 1/3 of the work holds\n")
