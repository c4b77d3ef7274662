"""What counts as a change, and the words for it; records of runs, moved to another machine."""

from __future__ import annotations

import tomllib

from coursebuild.core.engine.digests import ABSENT, SPECIAL
from coursebuild.core.model.results import Outcome, ScriptRun, Trace
from coursebuild.core.run.dependencies import (
    Dependency,
    Inputs,
    Kind,
    dependencies_of,
    describe,
    input_changes,
    is_there,
    state_changes,
)
from coursebuild.core.run.run_record import from_bytes, record_of, to_bytes
from support.fixture_cases import fixture_text

FIXTURE = tomllib.loads(fixture_text("scripts/changes.toml"))
ENVIRONMENT = (("Python", "CPython 3.11.7"), ("platform", "linux x86_64"))
INPUTS = Inputs("examples/a.py", "0" * 64, ("--fast",), 10.0, ("scipy",), ENVIRONMENT)


def test_changes_of_inputs() -> None:
    now = Inputs(
        "examples/a.py",
        "1" * 64,
        (),
        20.0,
        (),
        (("Python", "CPython 3.12.1"), ("environment variable MUJOCO_GL", "egl")),
        "of another version",
    )
    assert input_changes(INPUTS, now) == [
        "its text changed",
        "its arguments changed: --fast → none",
        "its option `timeout` changed: 10 → 20",
        "its option `requires` changed: scipy → none",
        "Python: CPython 3.11.7 → CPython 3.12.1",
        "environment variable MUJOCO_GL: unset → egl",
        "platform: linux x86_64 → unset",
        "this version of coursebuild runs scripts in another way",
    ]
    assert input_changes(INPUTS, INPUTS) == []


def test_a_printed_folder_is_a_dependency_but_for_the_top_of_the_disk() -> None:
    trace = Trace((), (), (), (), "")
    run = ScriptRun("examples/a.py", Outcome.OK, 0, "/home/a/b: 2/3\n", "", 0.1, trace=trace)
    for folder, names in (("/home/a", ["course"]), ("/home/c", []), ("/", [])):
        places = (("course", folder), ("library", "/opt/lib"))
        dependencies = dependencies_of(run, (), places, lambda need: need.name)
        assert [d.name for d in dependencies if d.kind is Kind.PLACE] == names, folder


def test_changes_of_states() -> None:
    for kind, name, then, now, words in FIXTURE["changes"]:
        dependency = Dependency(Kind(kind), name, then)
        assert list(state_changes([dependency], lambda _, now=now: now)) == [words]
        changes = list(state_changes([dependency], lambda _, then=then: then))
        assert (changes == []) == (then != SPECIAL)


def test_dependencies_as_lines() -> None:
    dependencies = [
        Dependency(Kind.FILE, "models/a.xml", "1"),
        Dependency(Kind.FILE, "models/b.xml", ABSENT),
        Dependency(Kind.LISTING, "models", "1"),
        Dependency(Kind.LISTING, "", "1"),
        Dependency(Kind.SOUGHT, "examples/{ast,json}", ""),
        Dependency(Kind.SOUGHT, "examples/{a,b,c,d,e,f,g,h}", ""),
        Dependency(Kind.MODULE, "numpy", "numpy 2.3.1"),
        Dependency(Kind.MODULE, "jax", ""),
        Dependency(Kind.MODULE, "mjcourse", "files 12"),
        Dependency(Kind.PLACE, "course", "/home/me"),
    ]
    assert [describe(dependency) for dependency in dependencies if is_there(dependency)] == [
        "models/a.xml",
        "the list of files in models",
        "the list of files in .",
        "numpy 2.3.1",
        "the files of the module mjcourse",
        "that /home/me is where it is: it printed that",
    ]


LOCAL_PLACES = (("course", "/home/me/course"), ("prefix", "/opt/venv"), ("home", "/home/me"))
REMOTE_PLACES = (("course", "/ci/build"), ("prefix", "/usr"), ("home", "/root"))
RECORD_INPUTS = Inputs("examples/a.py", "0" * 64, (), 10.0, (), (("Python", "3.11"),))


def test_a_traceback_is_moved_to_another_machine() -> None:
    stderr, moved_stderr = FIXTURE["traceback"]["here"], FIXTURE["traceback"]["there"]
    run = ScriptRun("examples/a.py", Outcome.FAILED, 1, "out\n", stderr, 0.25)
    data = to_bytes(record_of(RECORD_INPUTS, (), 1_700_000_000, "", run), LOCAL_PLACES)
    assert b"/home/me/course/" not in data and b"/opt/venv" not in data
    record = from_bytes(data)
    assert record.restore(LOCAL_PLACES).stderr == stderr
    assert record.restore(REMOTE_PLACES).stderr == moved_stderr


def test_a_course_at_the_top_of_the_disk_and_marks_that_a_script_printed() -> None:
    stderr = 'File "/examples/a.py", line 2: \0course\0 is half / 2\n'
    run = ScriptRun("examples/a.py", Outcome.FAILED, 1, "", stderr, 0.25)
    record = from_bytes(to_bytes(record_of(RECORD_INPUTS, (), 0, "", run), (("course", "/"),)))
    for course in ("/", "/ci/build"):
        assert record.restore((("course", course),)).stderr == stderr.replace("\0", "\ufffd")
