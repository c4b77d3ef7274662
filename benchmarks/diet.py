"""Measure the scene diet on two scenes: an arm with sensors, and an arm in a field of rubble.

Run: python benchmarks/diet.py [--pieces N] [--out DIR]

The scenes are written into a course of their own, in a temporary folder if no other is named, and
`coursebuild diet` looks at them. Printed are the time of a step as it is over that without what was
found, with its spread, for each finding.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

from coursebuild.core.engine.store import Store
from coursebuild.core.model.diet_findings import DietReport
from coursebuild.features.bench.commands.diet import diet
from coursebuild.features.bench.commands.measuring import Mjbench
from coursebuild.pipeline.options import Options


def arm(links: int = 6) -> str:
    """A chain of links under damping, each with a site and four sensors."""
    inner = ""
    for i in reversed(range(links)):
        axis = ("0 1 0", "0 0 1", "1 0 0")[i % 3]
        inner = (
            f'<body name="link{i}" pos="{0.2 if i else 0} 0 {0 if i else 2}">'
            f'<joint name="joint{i}" axis="{axis}" damping="0.5"/>'
            f'<geom type="capsule" fromto="0 0 0 0.2 0 0" size="0.03"/>'
            f'<site name="at{i}" pos="0.1 0 0"/>{inner}</body>'
        )
    sensors = "".join(
        f'<accelerometer site="at{i}"/><gyro site="at{i}"/><force site="at{i}"/>'
        f'<framepos objtype="site" objname="at{i}"/>'
        for i in range(links)
    )
    motors = "".join(f'<position name="motor{i}" joint="joint{i}" kp="5"/>' for i in range(links))
    return (
        f"<mujoco><worldbody><geom type='plane' size='60 60 1'/>{inner}RUBBLE</worldbody>"
        f"<actuator>{motors}</actuator><sensor>{sensors}</sensor></mujoco>"
    )


def rubble(pieces: int) -> str:
    """Boxes at rest, far away from what stands at the origin."""
    return "".join(
        f'<body pos="{20 + i % 8} {i // 8} 0.1"><freejoint/>'
        '<geom type="box" size="0.1 0.1 0.1"/></body>'
        for i in range(pieces)
    )


def main() -> None:
    """Write the scenes, examine them, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pieces", type=int, default=24, help="of rubble (default: %(default)s)")
    parser.add_argument("--out", type=Path, default=None, help="where the course goes")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        root = (arguments.out or Path(folder)).resolve()
        (root / "content").mkdir(parents=True, exist_ok=True)
        (root / "models").mkdir(exist_ok=True)
        (root / "content" / "course.toml").write_text('[course]\ntitle = "Two scenes"\n')
        (root / "models" / "arm.xml").write_text(arm().replace("RUBBLE", ""))
        field = arm().replace("RUBBLE", rubble(arguments.pieces))
        (root / "models" / "rubble.xml").write_text(field)
        with Mjbench(root, "this benchmark") as mjbench:
            measurement = diet(Options(root, 1, Store(root)), mjbench)
    for report in measurement.reports:
        show(report)


def show(report: DietReport) -> None:
    """A line for each finding that saves time."""
    print(f"{report.model}  (MuJoCo {report.machine.engine}, {report.machine.cpu})")
    for finding in report.findings:
        saving = finding.saving
        if saving.time is not None and saving.certain:
            print(f"  ×{saving.time:6.2f} ± {saving.spread:.2f}  {finding.kind}: {finding.label}")


if __name__ == "__main__":
    main()
