"""Records of runs, moved to another machine."""

from __future__ import annotations

from coursebuild.core.model.results import Outcome, ScriptRun
from coursebuild.core.run.dependencies import Inputs
from coursebuild.core.run.run_record import from_bytes, record_of, to_bytes

LOCAL_PLACES = (("course", "/home/me/course"), ("prefix", "/opt/venv"), ("home", "/home/me"))
REMOTE_PLACES = (("course", "/ci/build"), ("prefix", "/usr"), ("home", "/root"))
INPUTS = Inputs("examples/a.py", "0" * 64, (), 10.0, (), (("Python", "3.11"),))


def test_a_traceback_is_moved_to_another_machine() -> None:
    stderr = (
        'File "/home/me/course/examples/a.py", line 2\n'
        'File "/opt/venv/lib/python3.11/site-packages/numpy/x.py", line 3\n'
        "/home/me/course/examples/a.py:3: UserWarning: ~ is /home/me and /home/mexico\n"
        "a/home/me/course stays, /home/me/courses is in the home folder\n"
    )
    run = ScriptRun("examples/a.py", Outcome.FAILED, 1, "out\n", stderr, 0.25)
    data = to_bytes(record_of(INPUTS, (), 1_700_000_000, "", run), LOCAL_PLACES)
    assert b"/home/me/course/" not in data and b"/opt/venv" not in data
    record = from_bytes(data)
    assert record.restore(LOCAL_PLACES).stderr == stderr
    assert record.restore(REMOTE_PLACES).stderr == (
        'File "/ci/build/examples/a.py", line 2\n'
        'File "/usr/lib/python3.11/site-packages/numpy/x.py", line 3\n'
        "/ci/build/examples/a.py:3: UserWarning: ~ is /root and /home/mexico\n"
        "a/home/me/course stays, /root/courses is in the home folder\n"
    )


def test_a_course_at_the_top_of_the_disk_and_marks_that_a_script_printed() -> None:
    stderr = 'File "/examples/a.py", line 2: \0course\0 is half / 2\n'
    run = ScriptRun("examples/a.py", Outcome.FAILED, 1, "", stderr, 0.25)
    record = from_bytes(to_bytes(record_of(INPUTS, (), 0, "", run), (("course", "/"),)))
    for course in ("/", "/ci/build"):
        assert record.restore((("course", course),)).stderr == stderr.replace("\0", "\ufffd")
