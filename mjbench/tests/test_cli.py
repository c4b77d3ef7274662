"""The command `mjbench`, and its answers to another program."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from mjbench.bench import compile_subject, read_subject
from mjbench.cli import main
from mjbench.host import LocalHost
from mjbench.pruning import survey
from mjbench.reports.records import DIET

Capture = pytest.CaptureFixture[str]
ARM = """\
<mujoco>
  <option timestep="0.002"/>
  <worldbody>
    <body name="bob" pos="0 0 1"><joint name="pivot" axis="0 1 0"/><geom size=".05" pos=".3 0 0"/>
    </body>
  </worldbody>
  <sensor><clock name="time"/></sensor>
</mujoco>
"""
SWING = '[[scenario]]\nname = "swing"\nduration = 0.1\nsample = 0.02\ntimesteps = [0.002]\n'


@pytest.fixture
def model(tmp_path: Path) -> Path:
    file = tmp_path / "arm.xml"
    file.write_text(ARM)
    file.with_suffix(".toml").write_text(SWING)
    return file


@pytest.mark.long
def test_a_model_is_measured_recorded_and_checked(model: Path, capsys: Capture) -> None:
    record = str(model.with_name("arm.bench.json"))
    assert main([str(model), "--record", record]) == 0
    out = capsys.readouterr().out
    assert out.startswith("arm\n  swing\n    Euler at 2 ms: "), "the verdict comes first"
    for text in (" times real time\n", "Euler stays bounded", ">", "error: ", "largest timestep"):
        assert text in out, text
    assert main(["bench", str(model), "--check", record]) == 0
    assert capsys.readouterr().out == "as recorded\n"
    longer_arm = ARM.replace('pos=".3 0 0"/>', 'pos=".4 0 0"/><!-- länger -->')
    model.write_bytes(longer_arm.encode("latin-1"))
    assert main(["bench", str(model), "--check", record]) == 1
    assert "± 5 %" in capsys.readouterr().out


ENERGY = ARM.replace(
    '<option timestep="0.002"/>', '<option timestep="0.002"><flag energy="enable"/></option>'
)


def test_what_a_model_does_not_need_is_taken_out_and_its_interface_stays(
    model: Path, capsys: Capture
) -> None:
    record = str(model.with_name("arm.diet.json"))
    model.write_text(ENERGY)
    assert main(["diet", str(model), "--quick"]) == 1
    out = capsys.readouterr().out
    assert '    - <flag energy="enable"/>\n' in out
    assert main(["diet", str(model), "--quick", "--json"]) == 1
    assert not DIET.decode(capsys.readouterr().out.encode()).ok, "the same as a file of a report"
    assert f"shown by `mjbench diet {model} --only energy-flag`" in " ".join(out.split())
    assert "interface: nothing reads the sensor time" in out
    assert main(["diet", str(model), "--quick", "--only", "sensor-unread"]) == 0
    assert "energy-flag" not in capsys.readouterr().out
    code = model.with_name("use.py")
    code.write_text('print(data.sensor("time").data, data.energy)\n')
    assert main(["diet", str(model), "--quick", "--code", str(code)]) == 0
    capsys.readouterr()
    assert main(["diet", str(model), "--quick", "--fix"]) == 0
    assert capsys.readouterr().err == "changed arm.xml\n"
    assert "energy" not in model.read_text() and "sensor" in model.read_text()
    model.write_text(ENERGY)
    keep = '[[keep]]\nfinding = "energy-flag"\nreason = "for the plot"\n'
    model.with_suffix(".toml").write_text(SWING + keep)
    assert main(["diet", str(model), "--record", record]) == 0
    findings = DIET.decode(Path(record).read_bytes()).findings
    assert {f.kind: (f.label, f.kept) for f in findings if f.kind != "actuator-idle"} == {
        "energy-flag": ("proved", "for the plot"),
        "sensor-unread": ("interface", ""),
    }
    assert main(["show", record]) == 0 and "kept: for the plot" in capsys.readouterr().out
    motor = '<actuator><motor joint="pivot"/></actuator></mujoco>'
    model.write_text(ENERGY.replace("</mujoco>", motor))
    model.with_suffix(".toml").write_text(keep.replace("energy-flag", "unused-mesh"))
    assert main(["diet", str(model), "--quick"]) == 1
    out = capsys.readouterr().out
    assert "`unused-mesh` no longer keeps anything: remove the entry (arm.toml:2:12)" in out
    assert out.startswith("arm  (quick: short runs and rough times)\n  in seed-1, seed-2\n")


URDF = """\
<robot name="r">
  <link name="base"><collision><geometry><mesh filename="package://kit/meshes/a.obj"/></geometry>
  </collision></link>
  <link name="arm"><inertial><mass value="1"/>
    <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="j" type="continuous"><parent link="base"/><child link="arm"/></joint>
</robot>
"""
TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"


def test_a_package_of_urdf_is_the_folder_of_its_name(tmp_path: Path, capsys: Capture) -> None:
    file, mesh = tmp_path / "kit/urdf/r.urdf", tmp_path / "kit/meshes/a.obj"
    for path, text in ((file, URDF), (mesh, TETRAHEDRON)):
        path.parent.mkdir(parents=True)
        path.write_text(text, "utf-8")
    file.write_bytes(URDF.replace("<link", "<!-- länger --><link").encode("latin-1"))
    subject = read_subject(file)
    compiled_model = compile_subject(subject, LocalHost(tmp_path, lambda _: None), quick=True)
    assert compiled_model.model.nmesh == compiled_model.spec.compile().nmesh == 1
    assert main(["diet", str(file)]) == 2
    assert f"the diet edits MJCF, and {file} is none" in capsys.readouterr().err
    file.write_text(URDF.replace("kit", "kat"), "utf-8")
    assert main([str(file)]) == 2
    assert "from the package `kat`, and no folder of that name lies" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "toml", "status", "message"),
    [
        (["--quick", "{}.txt"], "", 2, "there is no file "),
        (["{}", "--quick", "--record", "a"], "", 2, "--quick measures only a part"),
        (["{}", "--engines", "mjocuo"], "", 2, "there is no engine `mjocuo`: known are mujoco, "),
        (["diet", "{}", "--only", "x"], "", 1, "arm.xml: no finding is of the kind `x`"),
        (["stability", "x"], "", 2, "no hard case or family of them is called `x`: tumbling-box, "),
        (["{}"], SWING.replace("0.1", "0.1001"), 1, "arm.toml: scenario.0.duration: `duration`"),
        (["{}"], SWING + "hold = true\n", 1, "arm.toml: Expected `float | null`, got `bool`"),
    ],
)
def test_mistakes_are_told_in_words(
    arguments: list[str], toml: str, status: int, message: str, model: Path, capsys: Capture
) -> None:
    model.with_suffix(".toml").write_text(toml)
    assert main([part.format(model) for part in arguments]) == status
    assert f"mjbench: error: {message}" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("name", "source", "status", "message"),
    [
        ("a.xml", "<mujoco>", 1, "the model `a` does not compile: XML parse error"),
        ("a.xml", "", 1, "the model `a` does not compile: ParseXML: empty file"),
        ("a.xml", '<mujoco><include file="b.xml"/></mujoco>', 1, "Error opening file 'b.xml'"),
        ("a.xml", ARM.replace("0.002", "0"), 1, "its timestep is 0 s, and time goes forward"),
        ("a.xml", ARM.replace("0.002", "-1"), 1, "its timestep is -1 s, and time goes forward"),
        ("a.py", "1 / 0", 2, "a.py fails: ZeroDivisionError: division by zero"),
        ("a.py", "raise SystemExit('no key')", 2, "a.py fails: SystemExit: no key"),
        ("a.py", "def spec(n): pass", 2, "a.py fails: TypeError: spec() missing 1 required"),
        ("a.py", "spec = 1", 2, "a.py defines no `spec` or `model` of MuJoCo's"),
    ],
)
def test_a_model_that_cannot_be_had_is_told_in_words(
    name: str, source: str, status: int, message: str, tmp_path: Path, capsys: Capture
) -> None:
    (tmp_path / name).write_text(source)
    assert main([str(tmp_path / name), "--quick"]) == status
    error = capsys.readouterr().err
    assert error.startswith("mjbench: error: ") and message in error


def test_what_is_no_report_is_told_with_its_name(model: Path, capsys: Capture) -> None:
    file = model.with_name("old.json")
    for text, reason in (
        ("{", "is damaged: Input data was truncated"),
        ("[]", "holds no report of mjbench"),
        ('{"holds": "mjbench diet", "version": 4}', "has version 4 of its format, and this one is"),
        ('{"holds": "mjbench diet", "version": 5}', "is damaged: Object missing required field"),
    ):
        file.write_text(text)
        assert main(["show", str(file)]) == 2
        assert capsys.readouterr().err.startswith(f"mjbench: error: {file} {reason}")
    assert main([str(model), "--check", str(file)]) == 2
    error = capsys.readouterr().err
    assert error == f"mjbench: error: {file} holds no report of `mjbench bench`\n"
    assert main(["show", str(file.with_name("none"))]) == 2
    assert capsys.readouterr().err.endswith("none: No such file or directory\n")


SPRING = """\
<mujoco><option timestep="0.01" gravity="0 0 0"/><worldbody><body>
  <joint name="rail" type="slide" damping="1"/><geom size=".1" mass="1"/></body></worldbody>
  <actuator><motor joint="rail"/></actuator></mujoco>
"""
STEP = '[[scenario]]\nname = "step"\nduration = 0.8\nsample = 0.02\ntimesteps = [0.005, 0.01]\n'
POLICY = """\
import os, signal
period = 0.02
def control(model, data):
    is_searched = model.opt.timestep > 0.011  # the search for stable timesteps tries longer ones
    if is_searched and {condition}:
        {action}
    return [1 - 5 * data.qpos[0]]
"""


def measure_under(policy: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """What `mjbench` says of a spring under a controller, in a process of its own."""
    (folder / "spring.xml").write_text(SPRING)
    (folder / "spring.toml").write_text(STEP)
    (folder / "policy.py").write_text(policy)
    words = ["spring.xml", "--quick", "--control", "policy.py"]
    command = [sys.executable, "-m", "mjbench", *words]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)


@pytest.mark.long
def test_what_is_known_is_printed_when_the_user_interrupts(tmp_path: Path) -> None:
    interrupt = "os.kill(os.getpid(), signal.SIGINT)"
    run = measure_under(POLICY.format(condition="True", action=interrupt), tmp_path)
    assert run.returncode == 130
    assert run.stderr == "mjbench: stopped; this is what is known\n"
    out = " ".join(run.stdout.split())
    assert "Euler at 10 ms: " in out and "errs by " in out and "│" in out, "verdict and plot"
    assert "largest timestep" not in out
    parts = [f"stable timesteps of {name}" for name in ("Euler", "implicit", "implicitfast")]
    assert f"not known: {', '.join(parts)}, " in out
    assert "delays: stopped before it was done" in out
    assert "the scenario step was not measured" not in out


def test_a_diet_that_is_stopped_says_what_it_has_found(
    model: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stop(*_: object) -> None:
        raise KeyboardInterrupt

    model.write_text(ENERGY)
    monkeypatch.setattr(survey, "far_bodies", stop)
    record = model.with_suffix(".json")
    assert main(["diet", str(model), "--record", str(record)]) == 130
    assert not record.exists()
    out, err = capsys.readouterr()
    assert "energy-flag: " in out
    assert "not explained" not in out
    assert err == (
        f"{record} is not written: not all was measured\nmjbench: stopped; this is what is known\n"
    )


def test_minutes_that_are_over_stop_it_as_the_user_does(tmp_path: Path, capsys: Any) -> None:
    (tmp_path / "spring.xml").write_text(SPRING)
    assert main([str(tmp_path / "spring.xml"), "--quick", "--minutes", "1e-9"]) == 130
    assert "mjbench: stopped" in capsys.readouterr().err


@pytest.mark.long
def test_an_integrator_that_fails_takes_nothing_else_with_it(tmp_path: Path) -> None:
    condition = "model.opt.integrator == 1"  # RK4
    run = measure_under(POLICY.format(condition=condition, action="raise ValueError(7)"), tmp_path)
    assert (run.returncode, run.stderr) == (0, "")
    out = " ".join(run.stdout.split())
    assert "not known: stable timesteps of RK4: LoopError: policy.py fails at 0 s" in out
    assert "Euler stays bounded" in out and "RK4 at 10 ms" in out
    assert "every 0.02 s small differences do not fade at its own delay, and it stays " in out


def converse(lines: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The answers to requests, and to questions where they stand in between."""
    text = "".join(json.dumps(line) + "\n" for line in lines)
    command = [sys.executable, "-m", "mjbench", "jobs"]
    run = subprocess.run(command, input=text, capture_output=True, text=True, check=True)
    return [json.loads(line) for line in run.stdout.splitlines()]


def test_another_program_is_asked_what_only_it_knows(model: Path) -> None:
    subject = {
        "folder": str(model.parent),
        "path": "arm.xml",
        "mjcf": ARM,
        "name": "arm",
        "digest": "a",
        "declarations_path": "arm.toml",
        "declarations": SWING,
        "exact": "arm.exact.py",
    }
    scenario = {"job": "scenario", "subject": subject, "number": 0, "quick": True, "timed": False}
    failure = {"output": "", "failure": "NameError: no"}
    answers = converse([{"job": "about"}, scenario, failure])
    assert "double-pendulum" in answers[0]["result"]["problems"]
    (question,) = (line["ask"] for line in answers if "ask" in line)
    script, path, query = question["exact"]
    assert script.endswith("exact.py") and path == "arm.exact.py" and "times" in json.loads(query)
    assert answers[-1]["failure"] == {
        "message": "`arm.exact.py` gives no motion: NameError: no",
        "help": "define `motion(time, qpos, qvel)` there, for the positions at a time in s",
        "place": {"path": "arm.exact.py", "keys": []},
        "cause": "scenario",
    }
