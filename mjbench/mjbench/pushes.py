"""What acts on a model from outside: forces on bodies for a while, and poses of mocap bodies."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from msgspec.structs import replace

from mjbench.declarations import DeclaredScenario, PushTable
from mjbench.problem import Scenario


def with_pushes_on_grid(declaration: DeclaredScenario, step: float) -> DeclaredScenario:
    """A scenario whose `hold` divides the times at which its pushes begin and end.

    Its commands and poses stay as long as they were. `step`: the model's own timestep, s, which
    divides all these times.
    """
    if not declaration.push:
        return declaration
    times = [time for push in declaration.push for time in (push.at, push.duration)]
    counts = [round(time / step) for time in times]
    before = None if declaration.hold is None else round(declaration.hold / step)
    hold = math.gcd(*counts, *([] if before is None else [before]))
    repeats = 1 if before is None else before // hold

    def repeat(rows: Sequence[Any]) -> tuple[Any, ...]:
        return tuple(row for row in rows for _ in range(repeats if len(rows) > 1 else 1))

    return replace(
        declaration,
        hold=float(f"{hold * step:.12g}"),
        controls=repeat(declaration.controls),
        poses={name: repeat(rows) for name, rows in declaration.poses.items()},
    )


def force_rows(
    model: Any, pushes: Sequence[PushTable], hold: float
) -> tuple[tuple[float, ...], ...]:
    """`xfrc_applied` in a row (6 nbody,) for each `hold` (s), and 0 behind the last push."""
    if not pushes:
        return ()
    spans = [(round(p.at / hold), round((p.at + p.duration) / hold)) for p in pushes]
    table = np.zeros((max(end for _, end in spans) + 1, int(model.nbody), 6))
    for push, (begin, end) in zip(pushes, spans, strict=True):
        table[begin:end, int(model.body(push.body).id)] += (*push.force, *push.torque)
    return tuple(map(tuple, table.reshape(len(table), -1).tolist()))


def pose_rows(
    model: Any, poses: Mapping[str, Sequence[Sequence[float]]], scenario: Scenario
) -> tuple[tuple[float, ...], ...]:
    """All mocap bodies in a row (7 nmocap,) for each of their poses.

    A body without a next pose stays where it is. A `keyframe` says where those are that have none.
    """
    if not poses:
        return ()
    key = scenario.keyframe
    table = np.empty((max(map(len, poses.values())), int(model.nmocap), 7))
    for body in np.flatnonzero(model.body_mocapid >= 0).tolist():
        number = int(model.body_mocapid[body])
        rows: Any = poses.get(str(model.body(body).name))
        if rows is None and key >= 0:
            place = model.key_mpos[key].reshape(-1, 3)[number]
            rows = [(*place, *model.key_mquat[key].reshape(-1, 4)[number])]
        elif rows is None:
            rows = [(*model.body_pos[body], *model.body_quat[body])]
        table[: len(rows), number], table[len(rows) :, number] = rows, rows[-1]
    lengths = np.linalg.norm(table[:, :, 3:], axis=2, keepdims=True)
    table[:, :, 3:] /= np.where(lengths == 0, 1.0, lengths)
    return tuple(map(tuple, table.reshape(len(table), -1).tolist()))
