"""What engines compute, compared with the reference of a scene and with MuJoCo itself.

Entry points: `engine_basis(model, scene)`, what is known before any engine is asked;
`judge_motion(basis, row, motion)`.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import asdict, replace

from coursebuild.numerics.engines.engine_trial import EngineMotion
from coursebuild.numerics.known_motion import KnownMotion, find_conserved, find_references
from coursebuild.numerics.measure import energy_drift, errors
from coursebuild.numerics.pilot import Pilot, own_setting, position_distances, run_pilot
from coursebuild.numerics.problem import Array
from coursebuild.numerics.reports.engine_report import EngineRow, EngineScenario
from coursebuild.numerics.scene import Scene
from coursebuild.numerics.simulation import (
    EngineStates,
    initial_data,
    integrator_of,
    invariants,
    motion_of,
    simulate,
    with_integrator,
)


class EngineBasis(Struct, frozen=True, eq=False):
    """What is known of a scene before any engine is asked."""

    model: Any
    pilot: Pilot
    reference: KnownMotion
    energy: float | None
    """The scale for changes of energy, J; `None` where energy is not conserved."""
    baseline: EngineStates
    """The motion in MuJoCo itself, at the model's own setting."""

    @property
    def report(self) -> EngineScenario:
        """The report, without rows."""
        scene, reference = self.pilot.scene, self.reference
        return EngineScenario(
            name=scene.name,
            title=scene.title,
            duration=scene.scenario.duration,
            horizon=reference.horizon,
            reference=reference.kind,
            source=reference.source,
            floor=reference.floor.place,
            velocity_floor=reference.floor.velocity,
            setting=own_setting(self.model, self.pilot),
            rows=(),
        )


def engine_basis(model: Any, scene: Scene, *, quick: bool = False) -> EngineBasis:
    """Find the reference of a scene, and how MuJoCo itself moves.

    Raises:
        SceneError: the scenario does not fit the model.
    """
    pilot = run_pilot(model, scene)
    setting = own_setting(model, pilot)
    reference = find_references(model, pilot, quick=quick)[setting.cone].reference
    energy, _ = find_conserved(model, pilot, reference)
    own_model = with_integrator(model, integrator_of(model), scene.timestep)
    return EngineBasis(model, pilot, reference, energy, simulate(pilot.setup, own_model).states)


def judge_motion(basis: EngineBasis, row: EngineRow, motion: EngineMotion) -> EngineRow:
    """Add to a row how far a motion is from the reference, and what it does to energy."""
    model, scenario, reference = basis.model, basis.pilot.scene.scenario, basis.reference
    row = replace(row, compile_seconds=motion.compile_seconds)
    times = scenario.times[: len(motion.qpos)]
    qpos, qvel = (np.array(part, dtype=np.float64) for part in (motion.qpos, motion.qvel))
    states = EngineStates(times, qpos, qvel, np.zeros((len(times), int(model.na))))
    if not (np.isfinite(qpos).all() and np.isfinite(qvel).all()):
        lost = int(np.argmin(np.isfinite(np.hstack([qpos, qvel])).all(axis=1)))
        message = f"the state is not finite at {times[lost]:.6g} s"
        return replace(row, status="diverged", message=message)
    energies, setup = _energies(basis, states), basis.pilot.setup
    bounds = (
        ("position", np.abs(qpos).max(), setup.position_bound),
        ("velocity", np.abs(qvel).max(), setup.velocity_bound),
        ("energy", energies.sum(axis=1).max(), setup.energy_bound),
    )
    for name, size, bound in bounds:
        if size > bound:
            message = f"its {name} reaches {size:.3g}, over {bound:.3g}"
            return replace(row, status="diverged", message=message)
    exact, count = motion_of(model, reference.states), len(reference.states.times)
    near = errors(motion_of(model, states.head(count)), exact, reference.floor)
    apart = position_distances(model, states.qpos[:count], basis.baseline.qpos[:count])
    drift = None if basis.energy is None else energy_drift(energies, basis.energy)
    return replace(row, **asdict(near), apart=float(apart.max()), energy_drift=drift)


def _energies(basis: EngineBasis, states: EngineStates) -> Array:
    """Potential and kinetic energy, first that of the beginning: (n + 1, 2) J."""
    model, scenario = basis.model, basis.pilot.scene.scenario
    beginning, scratch = initial_data(scenario, model), initial_data(scenario, model)
    table = [invariants(model, scratch, beginning.qpos, beginning.qvel)]
    for qpos, qvel in zip(states.qpos, states.qvel, strict=True):
        table.append(invariants(model, scratch, qpos, qvel))
    return np.array(table)[:, :2]
