"""Results of scripts at a place that machines share; runs are invented here."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from msgspec.structs import replace

from coursebuild.cli.explain import Explanation, RunExplanation, explanation_text
from coursebuild.core.files.trust import seal, unseal
from coursebuild.core.model.results import Divergence, Outcome, Sign, Trace
from coursebuild.core.run.dependencies import describe
from coursebuild.core.scripts.sensitivity import amplification
from coursebuild.report.text import Style
from support.fake_runs import JOB, MODEL_TRACE, PATH, SCRIPT, Desk
from support.poisoned_values import mutations

DIVERGENCE = Divergence(Sign.STATE, "0.5", "", PATH, 1)
STATE = "1 1 0x1.0p+0 0x1.0p+0 0x1.8p-1 0x0.0p+0"
UNSIGNED = b"unsigned"
"""The key of the seals at a place that is not signed."""
DAMAGED_MESSAGE = "the entry {}… in the shared cache is damaged: it is made again"


@pytest.fixture
def desk(tmp_path: Path) -> Desk:
    return Desk(tmp_path / "course")


def test_poisoned_results_of_a_shared_cache_are_one_or_told(tmp_path: Path) -> None:
    """A shared entry may hold any output, but nothing else is taken from it unchecked."""
    trace = Trace(("models/a.xml",), ("models",), (), ("json",), "", (DIVERGENCE,), True, (STATE,))
    place = tmp_path / "shared"
    Desk(tmp_path / "maker", shared=str(place)).run(trace, figures=(("a.svg", b"<svg/>"),))
    (entry,) = [path for path in place.rglob("*") if path.is_file()]
    name = entry.relative_to(place / "coursebuild-1").as_posix()
    whole = unseal(name, entry.read_bytes(), UNSIGNED)
    assert whole is not None
    victim = Desk(tmp_path / "victim", shared=str(place))
    believed = 0
    for data in mutations(whole, 200):
        shutil.rmtree(victim.root / ".coursebuild/scripts", ignore_errors=True)
        entry.write_bytes(seal(name, data, UNSIGNED))
        victim.messages.clear()
        run = victim.find_run()
        run_store = victim.run_store()
        reasons = run_store.reasons(run_store.inputs(JOB, SCRIPT))
        last = run_store.last_record(PATH)
        explanation = RunExplanation("script", PATH, "1.1", "remembered", tuple(reasons))
        if last is not None:
            depends = tuple(map(describe, last.dependencies))
            seconds = last.stored_run.seconds
            explanation = replace(
                explanation, depends=depends, made=last.timestamp, seconds=seconds
            )
        text = explanation_text(Explanation(PATH, "script", (explanation,)), Style(colour=False))
        assert "\x1b" not in text
        if run is None:
            assert victim.messages in ([], [DAMAGED_MESSAGE.format(name[:20])]), data
        else:
            believed += 1
            assert run.path == PATH
            amplification([run, run])
    assert 10 < believed < 160


def test_another_machine_has_the_result(desk: Desk, tmp_path: Path) -> None:
    desk.shared = str(tmp_path / "shared")
    desk.run(
        MODEL_TRACE, outcome=Outcome.FAILED, status=1, stderr=f'File "{desk.root}/examples/a.py"\n'
    )
    second_desk = Desk(tmp_path / "other", shared=desk.shared)
    run = second_desk.find_run()
    assert run is not None
    assert run.stderr == f'File "{second_desk.root}/examples/a.py"\n'
    second_desk.shared = None
    assert second_desk.find_run() is not None, "it is kept there too"
    third = Desk(tmp_path / "third", shared=desk.shared)
    third.write("models/a.xml", b"other")
    assert third.find_run() is None
    (path,) = (p for p in (tmp_path / "shared").rglob("*") if p.is_file())
    name = path.relative_to(tmp_path / "shared" / "coursebuild-1").as_posix()
    for number, data in enumerate((b"", b"{}", b"[1]", b"\x80\x04N.")):
        path.write_bytes(seal(name, data, UNSIGNED))  # an intact entry that is no record
        assert Desk(tmp_path / f"new {number}", shared=desk.shared).find_run() is None
