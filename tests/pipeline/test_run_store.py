"""The store of scripts' results; runs are invented here, the files that they read are real."""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from msgspec.structs import replace

from coursebuild.core.model.results import Outcome, Trace
from coursebuild.core.run.run_store import longest_first
from support.fake_runs import EMPTY_TRACE, JOB, MODEL_TRACE, PATH, SCRIPT, Desk

Act = Callable[[Desk], object]
SOUGHT_MODULE = Trace((), (), (), (), "", sought=("examples/{json}",))
ODD_PATH = os.fsdecode(b"models/\xff.bin")


@pytest.fixture
def desk(tmp_path: Path) -> Desk:
    return Desk(tmp_path / "course")


def entries(desk: Desk) -> list[Path]:
    return [path for path in (desk.root / ".coursebuild/scripts").rglob("*") if path.is_file()]


# --- remembered results


def test_results_and_failures_are_remembered_whole(desk: Desk) -> None:
    assert desk.find_run() is None
    assert desk.run_store().last_record(PATH) is None
    stderr = f'File "{desk.root}/examples/a.py", line 1\nValueError: no\n'
    for outcome, status in (
        (Outcome.OK, 0),
        (Outcome.FAILED, 3),
        (Outcome.OUTPUT_LIMIT, 9),
        (Outcome.ENCODING, 0),
    ):
        shutil.rmtree(desk.root / ".coursebuild", ignore_errors=True)
        desk.run(outcome=outcome, status=status, stderr=stderr, seconds=2.5)
        run, last = desk.find_run(), desk.run_store().last_record(PATH)
        assert run is not None and last is not None
        fields = run.outcome, run.status, run.stdout, run.stderr, run.seconds
        assert fields == (outcome, status, "hello\n", stderr, 2.5)
        assert run.cached and last.stored_run.seconds == 2.5


def outside(path: str) -> dict[str, Trace]:
    return {"trace": replace(EMPTY_TRACE, outside=(path,))}


UNSTORED_OUTCOMES: list[tuple[Outcome, dict[str, object], str]] = [
    (Outcome.TIMEOUT, {}, "it was stopped after its time limit"),
    (Outcome.KILLED, {}, "a signal ended it"),
    (Outcome.SKIPPED, {"missing": ("scipy", "jax")}, "it needs scipy, jax"),
    (Outcome.NORUN, {}, "its lesson says `norun`"),
    (Outcome.FAILED, {"stderr": "x\nModuleNotFoundError: jax"}, "it did not find a module"),
    (Outcome.FAILED, {"stderr": "ImportError: cannot import"}, "it did not find a module"),
    (Outcome.OK, {"trace": None}, "what it reads could not be observed"),
    (Outcome.OK, {"trace": replace(EMPTY_TRACE, opaque="it starts others")}, "it starts others"),
    (Outcome.OK, outside("/dev/random"), "it reads /dev/random"),
    (Outcome.OK, outside("/proc/stat"), "it reads /proc/stat"),
]


def test_runs_that_another_may_not_repeat_are_not_remembered(desk: Desk) -> None:
    for outcome, fields, reason in UNSTORED_OUTCOMES:
        shutil.rmtree(desk.root / ".coursebuild", ignore_errors=True)
        desk.run(outcome=outcome, **fields)
        assert (desk.find_run(), desk.rerun_reason()) == (None, reason)
        last = desk.run_store().last_record(PATH)
        assert last is not None and last.stored_run.outcome is outcome


def test_another_text_option_or_environment_is_another_result(
    desk: Desk, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    desk.run()
    for fields in ({"args": ("-v",)}, {"timeout": 20.0}, {"requires": ("numpy",)}):
        assert desk.find_run(replace(JOB, **fields)) is None, fields
    assert desk.find_run(text=SCRIPT + b"#\n") is None
    monkeypatch.setenv("MUJOCO_GL", "egl")
    assert desk.find_run() is None
    monkeypatch.delenv("MUJOCO_GL")
    for name in ("PATH", "HOME", "UNRELATED"):  # no input of a script
        monkeypatch.setenv(name, "/nowhere")
    assert desk.find_run() is not None


def test_a_few_results_are_kept_for_a_script(desk: Desk) -> None:
    for number in range(12):
        desk.write("models/a.xml", str(number).encode())
        desk.settle()
        desk.run(MODEL_TRACE, stdout=f"{number}\n")
    run = desk.find_run()
    assert run is not None and run.stdout == "11\n"
    assert len(entries(desk)) <= 8


def test_longest_runs_come_first_and_unknown_ones_before_them() -> None:
    jobs = [replace(JOB, path=name) for name in "abcd"]
    seconds = {"a": 1.0, "c": 3.0}
    assert [job.path for job in longest_first(jobs, seconds)] == ["b", "d", "c", "a"]


# --- when a result holds


def write(path: str, data: bytes = b"x") -> Act:
    return lambda desk: desk.write(path, data)


def remove(path: str) -> Act:
    return lambda desk: (desk.root / path).unlink()


def folder(path: str) -> Act:
    return lambda desk: (desk.root / path).mkdir()


def link(target: str) -> Act:
    def act(desk: Desk) -> None:
        (desk.root / "models/link.xml").unlink(missing_ok=True)
        (desk.root / "models/link.xml").symlink_to(target)

    return act


def write_with_the_same_time(desk: Desk) -> None:
    path = desk.root / "models/a.xml"
    status = path.stat()
    path.write_bytes(b"<mujacu/>")
    os.utime(path, ns=(status.st_atime_ns, status.st_mtime_ns))


def put_a_file_where_the_folder_was(desk: Desk) -> None:
    shutil.rmtree(desk.root / "models")
    (desk.root / "models").write_text("a file")


def files(*paths: str) -> Trace:
    return Trace(paths, (), (), (), "")


NOTICED_CHANGES: dict[str, tuple[list[Act], Trace, list[tuple[Act, bool]]]] = {
    "a file": (
        [],
        MODEL_TRACE,
        [
            (lambda desk: os.utime(desk.root / "models/a.xml"), True),
            (write("models/other.xml"), True),
            (write_with_the_same_time, False),
            (write("models/a.xml", b"<mujoco/>"), True),
            (folder("models/none.xml"), False),
        ],
    ),
    "a file that goes": (
        [],
        MODEL_TRACE,
        [
            (remove("models/a.xml"), False),
            (folder("models/a.xml"), False),
            (put_a_file_where_the_folder_was, False),
        ],
    ),
    "a link": (
        [write("models/b.xml"), link("a.xml")],
        files("models/link.xml"),
        [(link("b.xml"), False)],
    ),
    "a name that is no text": (
        [write(ODD_PATH, b"1")],
        files(ODD_PATH),
        [(write(ODD_PATH, b"2"), False)],
    ),
    "a name in capitals": ([], files("models/A.xml"), [(write("models/A.xml"), False)]),
    "a folder": (
        [],
        Trace((), ("models",), (), (), ""),
        [(write("models/a.xml"), True), (write("models/b.xml"), False)],
    ),
    "whether a file exists": (
        [],
        Trace((), (), (), (), "", existence=(("models/a.xml", "file"), ("data/b", "absent"))),
        [
            (write("models/a.xml", b"other content"), True),
            (write("models/b.xml"), True),
            (write("data/a"), True),
            (write("data/b"), False),
            (remove("data/b"), True),
            (remove("models/a.xml"), False),
        ],
    ),
    "the size of a file": (
        [write("size", b"12"), lambda desk: os.utime(desk.root / "size", ns=(9, 9))],
        Trace((), (), (), (), "", statuses=(("size", "file 644 2 9"),)),
        [
            (lambda desk: os.utime(desk.root / "size", ns=(1, 9)), True),
            (lambda desk: os.utime(desk.root / "size", ns=(9, 10)), False),
            (lambda desk: os.utime(desk.root / "size", ns=(9, 9)), True),
            (write("size", b"123"), False),
        ],
    ),
    "a module that is sought": (
        [],
        SOUGHT_MODULE,
        [(write("examples/picture.png"), True), (write("examples/json.py"), False)],
    ),
    "a file of the future": (
        [lambda desk: os.utime(desk.root / "models/a.xml", (4e9, 4e9))],
        MODEL_TRACE,
        [(write("models/a.xml"), False)],
    ),
}


def test_result_holds_until_something_that_was_looked_at_changes(tmp_path: Path) -> None:
    for name, (before, trace, steps) in NOTICED_CHANGES.items():
        desk = Desk(tmp_path / name)
        for act in before:
            act(desk)
        desk.settle()
        desk.run(trace)
        assert desk.find_run() is not None, name
        for number, (act, holds) in enumerate(steps, 1):
            act(desk)
            assert (desk.find_run() is not None) is holds, (name, number)


def test_a_file_outside_of_the_course_counts(desk: Desk, tmp_path: Path) -> None:
    outside = tmp_path / "outside.txt"
    outside.write_text("1")
    desk.settle()
    desk.run(Trace((), (), (str(outside),), (), ""))
    assert desk.find_run() is not None
    outside.write_text("2")
    assert desk.find_run() is None


def test_a_course_that_is_moved_runs_only_what_printed_its_place(
    desk: Desk, tmp_path: Path
) -> None:
    stderr = f'File "{desk.root}/examples/a.py"\n'
    desk.run(MODEL_TRACE, outcome=Outcome.FAILED, status=1, stderr=stderr)
    desk.root.rename(tmp_path / "moved")
    desk.root = tmp_path / "moved"
    run = desk.find_run()
    assert run is not None and run.stderr == f'File "{desk.root}/examples/a.py"\n'
    printing = replace(JOB, args=("--verbose",))
    desk.run(job=printing, stdout=f"reading {desk.root}/models/a.xml\n")
    assert desk.find_run(printing) is not None
    desk.root.rename(tmp_path / "again")
    desk.root = tmp_path / "again"
    assert desk.find_run(printing) is None


def test_a_module_that_changed_or_is_there_now(
    desk: Desk, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    packages = tmp_path / "site-packages"
    packages.mkdir()
    monkeypatch.syspath_prepend(packages)
    (packages / "wobble.py").write_text("SIZE = 1\n")
    needing = replace(JOB, requires=("nowhere_at_all",))
    desk.run(Trace((), (), (), ("wobble",), ""), needing)
    assert desk.find_run(needing) is not None
    (packages / "wobble.py").write_text("SIZE = 200\n")
    assert desk.find_run(needing) is None
    desk.run(Trace((), (), (), ("wobble",), ""), needing)
    (packages / "nowhere_at_all.py").write_text("")
    assert desk.find_run(needing) is None


def blink(desk: Desk) -> None:
    desk.write("models/none.xml", b"x")
    (desk.root / "models/none.xml").unlink()


WHILE_IT_RAN: tuple[tuple[Trace, Act, str], ...] = (
    (MODEL_TRACE, write("models/a.xml"), "models/a.xml changed while it ran"),
    (MODEL_TRACE, blink, "models/none.xml changed while it ran"),
    (EMPTY_TRACE, write(PATH, b"print('other')\n"), "its file changed while it ran"),
    (MODEL_TRACE, write("content/lessons/1.1-a.md"), ""),
    (SOUGHT_MODULE, write("examples/picture.png"), ""),
    (
        Trace((), (), (), (), "", existence=(("data/b", "absent"),)),
        write("data/b"),
        "data/b changed while it ran",
    ),
    (Trace((), (), (), (), "", existence=(("data/b", "absent"),)), write("data/c"), ""),
)


def test_result_is_not_kept_where_something_was_saved_while_the_script_ran(tmp_path: Path) -> None:
    for number, (trace, act, reason) in enumerate(WHILE_IT_RAN):
        desk = Desk(tmp_path / str(number))
        desk.run(trace, during=lambda act=act, desk=desk: act(desk))
        assert desk.rerun_reason() == reason
        assert (desk.find_run() is not None) is (reason == ""), number


def test_a_clock_that_is_set_back_while_a_script_runs_hides_no_save(
    desk: Desk, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is the system's, where the course's store is set aside."""
    desk.write(".coursebuild/from-elsewhere", b"")
    tomorrow = time.time_ns() + 86_400_000_000_000

    def set_back() -> None:
        monkeypatch.undo()
        desk.write("models/a.xml", b"<mujoco model='b'/>")

    monkeypatch.setattr(time, "time_ns", lambda: tomorrow)
    desk.run(MODEL_TRACE, during=set_back)
    assert desk.rerun_reason() == "the clock was set back while it ran"
    assert desk.find_run() is None


def test_a_module_that_appeared_while_the_script_ran_was_not_seen_by_it(desk: Desk) -> None:
    desk.run(SOUGHT_MODULE, during=lambda: desk.write("examples/json.py", b""))
    assert desk.find_run() is None
    (desk.root / "examples/json.py").unlink()
    assert desk.find_run() is not None


EDITED_PATHS = ("models/a.xml", "models/b.xml", "data.txt")
edits = st.tuples(st.sampled_from(EDITED_PATHS), st.sampled_from([b"1", b"2", b"", None]))


@settings(max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(edits, max_size=6), st.sets(st.sampled_from(EDITED_PATHS)))
def test_script_runs_again_if_and_only_if_a_file_it_read_changed(
    tmp_path_factory: pytest.TempPathFactory,
    changes: list[tuple[str, bytes | None]],
    looked: set[str],
) -> None:
    """A result is found exactly if the files that were read have been in this state before."""
    desk = Desk(tmp_path_factory.mktemp("course"))
    states: set[tuple[bytes | None, ...]] = set()

    def state() -> tuple[bytes | None, ...]:
        paths = [desk.root / path for path in sorted(looked)]
        return tuple(path.read_bytes() if path.exists() else None for path in paths)

    for path, data in [("data.txt", None), *changes]:
        if data is None:
            (desk.root / path).unlink(missing_ok=True)
        else:
            desk.write(path, data)
        now = state()
        run = desk.find_run()
        assert (run is not None) == (now in states)
        if run is None:
            desk.settle()
            desk.run(files(*sorted(looked)), stdout=repr(now))
            states.add(now)
        else:
            assert run.stdout == repr(now)


# --- fresh runs, damage, concurrency, sharing


def test_a_fresh_run_says_what_differs(desk: Desk) -> None:
    desk.run(MODEL_TRACE, stdout="one\n")
    desk.fresh = True
    assert desk.find_run() is None
    ((before, now),) = desk.run(MODEL_TRACE, stdout="two\n").differing_runs
    assert (before.stdout, now.stdout) == ("one\n", "two\n")
    assert desk.run(MODEL_TRACE, stdout="two\n").differing_runs == []
    desk.write("models/a.xml", b"other")
    desk.settle()
    assert desk.run(MODEL_TRACE, stdout="three\n").differing_runs == []
    desk.fresh = False
    run = desk.find_run()
    assert run is not None and run.stdout == "three\n", "the new result is the one that is kept"
