"""Results that are recalled together: the same ones as one by one, which need not be looked up."""

from __future__ import annotations

import shutil
import time
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from deskkit import LOOKED, SCRIPT, Desk

from coursebuild.effects.store import Store
from coursebuild.pipeline import recalled
from coursebuild.results import ScriptJob

JOBS = tuple(ScriptJob(f"examples/{name}.py", (), 10.0, (), False) for name in "abcdefghij")


@dataclass
class Course:
    """Ten scripts that look at one file, and what the next command remembers of them."""

    desk: Desk
    looked_up: list[str] = field(default_factory=list)
    """Groups that were looked at by themselves."""

    def run(self, jobs: tuple[ScriptJob, ...] = JOBS, **fields: object) -> None:
        for job in jobs:
            self.desk.run(LOOKED, job, **fields)  # type: ignore[arg-type]

    def recall(self) -> dict[str, str]:
        self.looked_up.clear()
        memory = self.desk.memory()
        found = memory.recall([memory.inputs(job, SCRIPT) for job in JOBS])
        memory.store.close()
        return {path: run.stdout for path, run in found.items()}


@pytest.fixture
def course(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Course:
    desk = Desk(tmp_path / "course")
    for job in JOBS:
        desk.write(job.path, SCRIPT)
    desk.settle()
    made = Course(desk)
    group = Store.group

    def noted(store: Store, kind: str, key: str, *, newest: int = 8) -> list[str]:
        made.looked_up.append(key)
        return group(store, kind, key, newest=newest)

    monkeypatch.setattr(Store, "group", noted)
    monkeypatch.setattr(recalled, "_SETTLED", 0)
    return made


def test_the_second_time_none_is_looked_up(course: Course) -> None:
    course.run()
    one_by_one = course.recall()
    assert len(one_by_one) == len(course.looked_up) == len(JOBS)
    assert course.recall() == one_by_one
    assert course.looked_up == []


def test_another_result_of_the_same_script_counts(course: Course) -> None:
    course.run()
    course.recall()
    course.run(JOBS[:1], stdout="otherwise\n")
    found = course.recall()
    assert found[JOBS[0].path] == "otherwise\n"
    assert len(course.looked_up) == 1
    assert course.recall() == found
    assert course.looked_up == []


def test_none_is_used_that_does_not_hold(course: Course) -> None:
    course.run()
    course.recall()
    course.desk.write("models/a.xml", b"<mujoco model='b'/>")
    assert course.recall() == {}
    course.desk.write("models/a.xml", b"<mujoco/>")
    assert len(course.recall()) == len(JOBS)


def test_none_is_used_that_is_no_longer_kept(course: Course) -> None:
    course.run()
    course.recall()
    shutil.rmtree(course.desk.root / ".coursebuild/scripts")
    assert course.recall() == {}


def test_after_a_while_all_are_looked_up(course: Course, monkeypatch: pytest.MonkeyPatch) -> None:
    course.run()
    found = course.recall()
    now = time.time()
    monkeypatch.setattr(time, "time", lambda: now + 4000)
    assert course.recall() == found
    assert len(course.looked_up) == len(JOBS)


def test_what_was_changed_just_now_is_not_known_by_its_time(
    course: Course, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(recalled, "_SETTLED", 3600 * 10**9)
    course.run()
    found = course.recall()
    assert course.recall() == found
    assert len(course.looked_up) == len(JOBS)


def test_other_bytes_are_no_results(course: Course, monkeypatch: pytest.MonkeyPatch) -> None:
    course.run()
    found = course.recall()
    peek = Store.peek

    def cut(store: Store, kind: str, key: str, *, packed: bool = True) -> bytes | None:
        data = peek(store, kind, key, packed=packed)
        return data[:-40] if data is not None and kind == "recalled" else data

    monkeypatch.setattr(Store, "peek", cut)
    assert course.recall() == found
    assert len(course.looked_up) == 1, "the last row is cut"
