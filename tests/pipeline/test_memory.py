"""What is remembered of scripts: runs here are made up, the files that they look at are real."""

from __future__ import annotations

import threading
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from msgspec.structs import replace

from coursebuild.core.model.results import Outcome, ScriptJob, Trace
from coursebuild.pipeline.remember import longest_first
from support.fake_runs import JOB, LOOKED, NOTHING, PATH, SCRIPT, Desk


@pytest.fixture
def desk(tmp_path: Path) -> Desk:
    return Desk(tmp_path / "course")


def test_nothing_is_remembered_at_first(desk: Desk) -> None:
    assert desk.recall() is None
    assert desk.memory().last(PATH) is None


def test_a_result_is_remembered(desk: Desk) -> None:
    desk.run(stderr="a warning\n")
    found = desk.recall()
    assert found is not None
    assert (found.outcome, found.status, found.stdout, found.stderr, found.seconds) == (
        Outcome.OK,
        0,
        "hello\n",
        "a warning\n",
        0.5,
    )
    assert found.cached


@pytest.mark.parametrize(
    ("outcome", "status"),
    [(Outcome.FAILED, 3), (Outcome.OUTPUT_LIMIT, 9), (Outcome.ENCODING, 0)],
)
def test_failures_are_remembered_with_their_message(
    desk: Desk, outcome: Outcome, status: int
) -> None:
    stderr = f'File "{desk.root}/examples/a.py", line 1\nValueError: no\n'
    desk.run(outcome=outcome, status=status, stderr=stderr)
    found = desk.recall()
    assert found is not None
    assert (found.outcome, found.status, found.stderr) == (outcome, status, stderr)


@pytest.mark.parametrize("outcome", [Outcome.TIMEOUT, Outcome.KILLED, Outcome.SKIPPED])
def test_stopped_and_killed_runs_are_not_remembered(desk: Desk, outcome: Outcome) -> None:
    desk.run(outcome=outcome, status=9)
    assert desk.recall() is None
    last = desk.memory().last(PATH)
    assert last is not None and last.outcome is outcome and last.forgotten


def test_an_opaque_or_unwatched_run_is_not_remembered(desk: Desk) -> None:
    desk.run(replace(NOTHING, opaque="it starts other programs"))
    assert desk.recall() is None
    assert desk.why() == "it starts other programs"
    desk.run(None)
    assert desk.recall() is None


@pytest.mark.parametrize(
    "job",
    [
        replace(JOB, args=("-v",)),
        replace(JOB, timeout=20.0),
        replace(JOB, requires=("numpy",)),
    ],
)
def test_another_option_is_another_result(desk: Desk, job: ScriptJob) -> None:
    desk.run()
    assert desk.recall(job) is None


def test_another_text_is_another_result(desk: Desk) -> None:
    desk.run()
    assert desk.recall(text=SCRIPT + b"#\n") is None
    assert desk.recall() is not None


def test_environment_counts_only_where_a_script_can_see_it(
    desk: Desk, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    desk.run()
    monkeypatch.setenv("MUJOCO_GL", "egl")
    assert desk.recall() is None
    monkeypatch.delenv("MUJOCO_GL")
    monkeypatch.setenv("PATH", "/nowhere")
    monkeypatch.setenv("HOME", "/nowhere")
    monkeypatch.setenv("UNRELATED", "1")
    assert desk.recall() is not None


def entries(desk: Desk) -> list[Path]:
    return [path for path in (desk.root / ".coursebuild/scripts").rglob("*") if path.is_file()]


def test_a_damaged_result_is_told_and_run_again(desk: Desk) -> None:
    desk.run()
    (path,) = entries(desk)
    whole = path.read_bytes()
    for at in range(0, len(whole), 7):
        path.write_bytes(whole[:at] + bytes([whole[at] ^ 0x40]) + whole[at + 1 :])
        desk.told.clear()
        assert desk.recall() is None
        assert len(desk.told) == 1
        assert desk.told[0].endswith("in .coursebuild is damaged: it is made again")
        desk.told.clear()
        assert desk.recall() is None
        assert desk.told == [], "it is gone"
        desk.run()
    for end in (0, 1, 31, 32, 33, len(whole) - 1):
        path.write_bytes(whole[:end])
        assert desk.recall() is None
        desk.run()


def test_result_under_the_name_of_another_is_not_taken(desk: Desk) -> None:
    desk.run()
    (one,) = entries(desk)
    other = replace(JOB, args=("-v",))
    desk.run(job=other)
    (two,) = set(entries(desk)) - {one}
    two.write_bytes(one.read_bytes())
    assert desk.recall(other) is None


def test_a_few_results_are_kept_for_a_script(desk: Desk) -> None:
    for number in range(12):
        desk.write("models/a.xml", str(number).encode())
        desk.settle()
        desk.run(LOOKED, stdout=f"{number}\n")
    found = desk.recall()
    assert found is not None and found.stdout == "11\n"
    assert len(entries(desk)) <= 8


def test_a_store_that_cannot_be_written(desk: Desk) -> None:
    (desk.root / ".coursebuild").write_text("in the way")
    desk.run()
    assert desk.recall() is None
    assert len(desk.told) >= 1


def test_several_commands_at_once(desk: Desk) -> None:
    threads = [threading.Thread(target=desk.run, args=(LOOKED,)) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert desk.recall() is not None
    assert len(entries(desk)) == 1


# --- afresh


def test_a_fresh_run_says_what_differs(desk: Desk) -> None:
    desk.run(stdout="one\n")
    desk.fresh = True
    assert desk.recall() is None
    memory = desk.run(stdout="two\n")
    ((before, now),) = memory.differing
    assert (before.stdout, now.stdout) == ("one\n", "two\n")
    desk.fresh = False
    found = desk.recall()
    assert found is not None and found.stdout == "two\n", "the new result is the one that is kept"
    desk.fresh = True
    assert desk.run(stdout="two\n").differing == []


def test_a_fresh_run_with_another_file_differs_from_nothing(desk: Desk) -> None:
    desk.run(LOOKED, stdout="one\n")
    desk.write("models/a.xml", b"other")
    desk.settle()
    desk.fresh = True
    assert desk.run(LOOKED, stdout="two\n").differing == []


# --- shared


def test_another_machine_has_the_result(desk: Desk, tmp_path: Path) -> None:
    desk.shared = str(tmp_path / "shared")
    desk.run(LOOKED, outcome=Outcome.FAILED, status=1, stderr=f'File "{desk.root}/examples/a.py"\n')
    other = Desk(tmp_path / "other", shared=desk.shared)
    found = other.recall()
    assert found is not None
    assert found.stderr == f'File "{other.root}/examples/a.py"\n'
    other.shared = None
    assert other.recall() is not None, "it is kept there too"
    third = Desk(tmp_path / "third", shared=desk.shared)
    third.write("models/a.xml", b"other")
    assert third.recall() is None


def test_shared_entry_that_holds_no_record_is_not_taken(desk: Desk, tmp_path: Path) -> None:
    """An entry that is whole, and holds what no record holds, or one of another script."""
    shared = tmp_path / "shared"
    desk.shared = str(shared)
    desk.run()
    other = replace(JOB, path="examples/b.py")
    desk.write(other.path, SCRIPT)
    desk.settle()
    desk.run(job=other)
    one, two = sorted(p for p in shared.rglob("*") if p.is_file())
    for data in (b"", b"{}", b"[1]", b"\x80\x04N."):
        from coursebuild.core.engine.memo import sealed

        for path in (one, two):
            name = path.relative_to(shared / "coursebuild-1").as_posix()
            path.write_bytes(sealed(name, data))
        fresh = Desk(tmp_path / f"new{len(data)}", shared=desk.shared)
        assert fresh.recall() is None


# --- order


def test_the_longest_run_first_and_unknown_ones_before_them() -> None:
    jobs = [replace(JOB, path=name) for name in "abcd"]
    seconds = {"a": 1.0, "b": None, "c": 3.0}
    assert [job.path for job in longest_first(jobs, seconds)] == ["b", "d", "c", "a"]


def test_what_a_run_took_is_known_afterwards(desk: Desk) -> None:
    desk.run(seconds=2.5)
    last = desk.memory().last(PATH)
    assert last is not None and last.seconds == 2.5


# --- if and only if

FILES = ("models/a.xml", "models/b.xml", "data.txt")
edits = st.tuples(st.sampled_from(FILES), st.sampled_from([b"1", b"2", b"", None]))


@settings(max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(edits, max_size=6), st.sets(st.sampled_from(FILES)))
def test_script_runs_again_if_and_only_if_a_file_it_read_changed(
    tmp_path_factory: pytest.TempPathFactory,
    changes: list[tuple[str, bytes | None]],
    looked: set[str],
) -> None:
    """A result is there exactly where the files that were looked at were like this before."""
    desk = Desk(tmp_path_factory.mktemp("course"))
    trace = Trace(tuple(sorted(looked)), (), (), (), "")
    known: set[tuple[bytes | None, ...]] = set()

    def state() -> tuple[bytes | None, ...]:
        paths = [desk.root / path for path in sorted(looked)]
        return tuple(path.read_bytes() if path.exists() else None for path in paths)

    for path, data in [("data.txt", None), *changes]:
        if data is None:
            (desk.root / path).unlink(missing_ok=True)
        else:
            desk.write(path, data)
        now = state()
        found = desk.recall()
        assert (found is not None) == (now in known)
        if found is None:
            desk.settle()
            desk.run(trace, stdout=repr(now))
            known.add(now)
        else:
            assert found.stdout == repr(now)
