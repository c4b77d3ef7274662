"""The browser's engine in this process: code that hangs, eats memory or breaks it is reported."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from coursebuild.core.files.errors import EffectError
from coursebuild.core.run.v8 import StoppedError
from coursebuild.features.lab.engines import browser, native
from coursebuild.features.lab.engines.browser import LabEngine
from coursebuild.features.lab.engines.native import LAB_ENGINE
from support.lab_values import BALL, Bench, lab_of, make_lab, request
from support.runners import processor_time
from support.waiting import wait_until

pytestmark = pytest.mark.engine

LOOP = "for (;;) ;"


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bench]:
    """Both engines. A busy machine may need longer than the usual patience to fill the memory."""
    with Bench(tmp_path_factory.mktemp("course")) as bench:
        bench.browser = LabEngine(patience=300.0)
        yield bench


def failures_of(reply: dict[str, Any]) -> list[tuple[Any, str, str]]:
    return [(tuple(f["entry"]), f["kind"], f.get("message", "")) for f in reply["failures"]]


def test_endless_loop_is_told_at_its_entry_and_the_next_lab_is_tried(bench: Bench) -> None:
    plot = {"ylabel": "y", "traces": [{"label": "t", "expr": f"(() => {{ {LOOP} }})()"}]}
    labs: list[tuple[dict[str, Any], tuple[Any, ...]]] = [
        ({"controller": f"if (sim.time > 0.005) {LOOP}"}, ("controller",)),
        ({"plots": [plot]}, ("plots", 0, "traces", 0, "expr")),
    ]
    for fields, entry in labs:
        reply = bench.trial(make_lab(verify={"seconds": 0.02}, **fields), seconds=0.5)
        assert failures_of(reply) == [(entry, "timeout", "ran for more than 0.5 s")]
        assert (reply["main"], reply["version"]) == (None, LAB_ENGINE)
    assert failures_of(bench.trial(make_lab())) == []


def test_code_that_never_returns_is_told_long_before_a_lab_that_simulates_much(
    tmp_path: Path,
) -> None:
    button = {"type": "button", "label": "b", "run": LOOP}
    with Bench(tmp_path) as bench:
        bench.browser = LabEngine(patience=0.5)
        stuck = bench.trial(make_lab(verify={"seconds": 0.02}, controls=[button]), seconds=600.0)
        assert failures_of(stuck) == [
            (("controls", 0, "run"), "timeout", "ran for more than 0.5 s")
        ]
        slow = bench.trial(make_lab(verify={"seconds": 1e9}), seconds=1.5)
        assert failures_of(slow) == [((), "timeout", "did not finish in time")]


def test_memory_that_runs_out_takes_no_other_lab_along(tmp_path: Path) -> None:
    eat = "ctx.all = []; for (;;) ctx.all.push(new Array(10000).fill(ctx.all.length + 0.5))"
    with Bench(tmp_path) as bench:
        bench.browser = LabEngine(memory=160)
        reply = bench.trial(make_lab(setup=eat))
        assert failures_of(reply) == [(("setup",), "timeout", "took more than 160 MiB")]
        assert failures_of(bench.trial(make_lab())) == []


def test_what_a_model_reserves_is_no_reason_to_refuse_it(bench: Bench) -> None:
    """Of a simulation as large as three of MuJoCo's examples, it uses a few hundredths."""
    for size in ("1G", "20G"):
        xml = BALL.replace("<mujoco>", f'<mujoco><size memory="{size}"/>')
        lab = make_lab(xml=xml, verify={"seconds": 0.1})
        assert bench.parity(lab)["first"] is None
        reply = bench.trial(lab_of(f"Text.\n\n```lab mjcf\n{xml}\n```\n"))
        assert (failures_of(reply), reply["main"]["diverged"]) == ([], False)


@pytest.mark.long
def test_code_that_takes_all_memory_or_breaks_the_engine_is_told_and_goes(bench: Bench) -> None:
    for code in (
        "ctx.all = []; for (;;) ctx.all.push(new mj.DoubleBuffer(5000000))",
        "ctx.all = []; for (;;) ctx.all.push(new ArrayBuffer(100000000))",
        "(function f() { return f() + 1 })()",
        "ctx.s = 'x'; for (;;) ctx.s += ctx.s",
        "throw null",
        "throw {toString() { throw 1 }}",
        "Promise.reject(1); null.x",
        "mj.MjModel.from_xml_string('<mujoco')",
        "model.delete()",
    ):
        reply = bench.trial(make_lab(setup=code), seconds=300.0)
        kinds = {kind for _, kind, _ in failures_of(reply)}
        assert kinds and kinds <= {"throws", "engine"} and reply["main"] is None, code
        assert failures_of(bench.trial(make_lab())) == [], code
    reply = bench.browser.trial(request(make_lab()), b"no model at all" * 100, 120.0)
    assert [kind for _, kind, _ in failures_of(reply)] == ["engine"]
    assert failures_of(bench.trial(make_lab())) == []


def test_code_that_changes_what_all_labs_share_is_told_and_undone(bench: Bench) -> None:
    ordinary = make_lab(
        setup="data.qvel.set([1], 0)",
        readouts=[{"label": "r", "expr": "`${typeof count} ${data.qvel[0]}`"}],
    )
    for code, name in (
        ("globalThis.count = 1; mj.mj_step = () => {}", "`count`, `mj.mj_step`"),
        ("Object.freeze(Math)", None),
        ("Reflect.ownKeys = Map.prototype.get = JSON.stringify = null", None),
        ("globalThis.trial = null", "`trial`"),
    ):
        ((entry, kind, message),) = failures_of(bench.trial(make_lab(setup=code)))
        assert (entry, kind) == (("setup",), "shared"), code
        assert name is None or message == name
        reply = bench.trial(ordinary)
        assert failures_of(reply) == [], code
        assert reply["main"]["pictures"][0]["readouts"] == ["undefined 1"], code


def test_lab_sets_no_timers(bench: Bench) -> None:
    for code in ("setTimeout(() => {}, 10)", "ctx.later = setTimeout(() => {})"):
        ((entry, kind, message),) = failures_of(bench.trial(make_lab(setup=code)))
        assert (entry, kind) == (("setup",), "throws")
        assert message == "Error: a lab sets no timers: they would ring in the next one"
    assert failures_of(bench.trial(make_lab(setup="ctx.can = typeof setTimeout"))) == []


def test_nothing_of_one_trial_is_left_for_the_next(bench: Bench) -> None:
    bench.trial(make_lab(setup="ctx.left = 1; model.opt.timestep = 0.01; data.qpos[0] = 9"))
    lab = make_lab(
        readouts=[{"label": "r", "expr": "`${ctx.left} ${model.opt.timestep} ${data.qpos[0]}`"}]
    )
    reply = bench.trial(lab)
    assert reply["main"]["pictures"][0]["readouts"] == ["undefined 0.002 0"]


def test_memory_does_not_grow_from_trial_to_trial(bench: Bench) -> None:
    """Both WebAssembly's own and the process's."""

    def resident() -> int:
        pages = Path("/proc/self/statm").read_text().split()[1]
        return int(pages) * os.sysconf("SC_PAGE_SIZE")

    lab = make_lab(verify={"seconds": 0.02})
    for _ in range(10):
        bench.trial(lab)
    before = resident()
    for _ in range(30):
        bench.trial(lab)
    assert resident() - before < 30 << 20


def test_engine_that_is_stopped_from_another_thread_tries_no_more(tmp_path: Path) -> None:
    with Bench(tmp_path) as bench:
        mjb = bench.native.save("models/x.xml", BALL)
        bench.browser.check_code([])
        threading.Timer(0.2, bench.browser.stop).start()
        with pytest.raises(StoppedError):
            bench.browser.trial(request(make_lab(setup=LOOP)), mjb, 600.0)
        with pytest.raises(StoppedError):
            bench.browser.trial(request(make_lab()), mjb, 60.0)
    never = LabEngine()
    never.stop()
    with pytest.raises(StoppedError):
        never.check_code([])


def test_an_interrupt_ends_a_trial_and_the_process() -> None:
    code = (
        "import atexit, gc, sys; sys.path.insert(0, 'tests')\n"
        "atexit.register(gc.freeze)\n"  # as commands do
        "from pathlib import Path\n"
        "from support.lab_values import *\n"
        "with Bench(Path('.')) as bench:\n"
        "    bench.browser.check_code([])\n"
        "    mjb = bench.native.save('models/x.xml', BALL)\n"
        "    trial_request = request(make_lab(setup='for (;;) ;'))\n"
        "    try:\n"
        "        print('ready', flush=True)\n"
        "        bench.browser.trial(trial_request, mjb, 600.0)\n"
        "    except KeyboardInterrupt: print('interrupted')\n"
    )
    process = subprocess.Popen(
        [sys.executable, "-W", "always", "-c", code],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=Path(browser.__file__).parents[4],
    )
    with process:
        assert process.stdout is not None
        process.stdout.readline()
        before = processor_time(process.pid)
        wait_until(lambda: processor_time(process.pid) > before + 30, "the trial's loop")
        os.kill(process.pid, signal.SIGINT)
        output, errors = process.communicate()
    assert (output, errors, process.returncode) == ("interrupted\n", "", 0)


def test_damaged_engine_is_told_and_a_sound_one_starts_again(
    bench: Bench, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    folder = tmp_path / "assets"
    for name in ("mujoco/mujoco.wasm", "js/lab-trial.js"):
        (folder / name).parent.mkdir(parents=True)
        (folder / name).write_bytes((native.assets_dir() / name).read_bytes())
    wasm = folder / "mujoco/mujoco.wasm"
    wasm.write_bytes(wasm.read_bytes()[:100_000])
    bench.browser.close()
    bench.browser.close()
    with monkeypatch.context() as damaged:
        damaged.setattr(native, "assets_dir", lambda: folder)
        with pytest.raises(EffectError, match=r"the browser.s engine does not start: .*Compile"):
            bench.trial(make_lab())
    assert failures_of(bench.trial(make_lab())) == []
