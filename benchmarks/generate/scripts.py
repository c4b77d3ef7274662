"""The script of a lesson and the output that is recorded for it.

Entry point: `make_script`. The output is not imitated: the script is run once, in this process, and
what it prints is recorded.
"""

from __future__ import annotations

import contextlib
import io

from benchmarks.generate.document import Script
from benchmarks.generate.topics import Fill, Topic, pick

METHODS = ("Euler", "Heun", "midpoint", "RK4")

INTEGRATE = '''"""@{title}: four one-step methods beside the solution in closed form.

Run it with: python @{path}
"""

import math
from collections.abc import Callable

State = tuple[float, ...]
Rates = Callable[[float, State], State]

@{constants}
DURATION = @{duration}  # s
STEPS = (@{steps})
START: State = @{start}


def rates(t: float, y: State) -> State:
    """The time derivative of (@{state})."""
    @{state} = y
    return @{rates}


def exact(t: float) -> State:
    """The solution (@{state}) at the time t."""@{exact}

def moved(y: State, h: float, k: State) -> State:
    """The state y, moved by the time h along k."""
    return tuple(a + h * b for a, b in zip(y, k, strict=True))


def euler(f: Rates, t: float, y: State, h: float) -> State:
    """One step of order 1."""
    return moved(y, h, f(t, y))


def heun(f: Rates, t: float, y: State, h: float) -> State:
    """One step of order 2: the mean of the rates at both ends."""
    first = f(t, y)
    second = f(t + h, moved(y, h, first))
    return moved(moved(y, h / 2, first), h / 2, second)


def midpoint(f: Rates, t: float, y: State, h: float) -> State:
    """One step of order 2: the rates half-way."""
    return moved(y, h, f(t + h / 2, moved(y, h / 2, f(t, y))))


def rk4(f: Rates, t: float, y: State, h: float) -> State:
    """One step of order 4."""
    k1 = f(t, y)
    k2 = f(t + h / 2, moved(y, h / 2, k1))
    k3 = f(t + h / 2, moved(y, h / 2, k2))
    k4 = f(t + h, moved(y, h, k3))
    total = tuple(a + 2 * b + 2 * c + d for a, b, c, d in zip(k1, k2, k3, k4, strict=True))
    return moved(y, h / 6, total)


METHODS = {"Euler": euler, "Heun": heun, "midpoint": midpoint, "RK4": rk4}


def largest_error(name: str, count: int) -> float:
    """The largest distance from the solution at any of the steps."""
    h, y, worst = DURATION / count, START, 0.0
    for i in range(count):
        y = METHODS[name](rates, i * h, y, h)
        worst = max(worst, math.dist(y, exact((i + 1) * h)))
    return worst


def main() -> None:
    """Print the errors for each method and number of steps, and the orders they show."""
    print("at the end: " + "  ".join(f"{value:.5f}" for value in exact(DURATION)))
    for name in METHODS:
        errors = [largest_error(name, count) for count in STEPS]
        orders = [math.log2(a / b) for a, b in zip(errors, errors[1:], strict=False)]
        for count, error in zip(STEPS, errors, strict=True):
            print(f"{name:<9} {count:4d} steps  largest error {error:.2e}")
        print(f"{name:<9} observed order {orders[-1]:.3f}")


if __name__ == "__main__":
    main()
'''

SIMULATE = '''"""@{title}: two links in MuJoCo, and the energy that integrators lose.

Run it with: python @{path}
"""

import mujoco
import numpy as np

DURATION = @{duration}  # s
STEPS = (@{steps})
MODEL = """
<mujoco>
  <option gravity="0 0 -9.81">
    <flag energy="enable" contact="disable"/>
  </option>
  <default>
    <geom type="capsule" size="0.02" density="@{density}"/>
  </default>
  <worldbody>
    <body name="upper" pos="0 0 2">
      <joint name="shoulder" axis="0 1 0"/>
      <geom fromto="0 0 0 0 0 -@{upper}"/>
      <body name="lower" pos="0 0 -@{upper}">
        <joint name="elbow" axis="0 1 0" damping="@{damping}"/>
        <geom fromto="0 0 0 0 0 -@{lower}"/>
      </body>
    </body>
  </worldbody>
  <keyframe>
    <key name="start" qpos="@{first} @{second}"/>
  </keyframe>
</mujoco>
"""
INTEGRATORS = {
    "Euler": mujoco.mjtIntegrator.mjINT_EULER,
    "implicit": mujoco.mjtIntegrator.mjINT_IMPLICIT,
    "implicitfast": mujoco.mjtIntegrator.mjINT_IMPLICITFAST,
    "RK4": mujoco.mjtIntegrator.mjINT_RK4,
}


def compiled() -> tuple[mujoco.MjModel, mujoco.MjData]:
    """The pendulum at its first keyframe."""
    model = mujoco.MjModel.from_xml_string(MODEL)
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("start").id)
    mujoco.mj_forward(model, data)
    return model, data


def run(name: str, count: int) -> tuple[np.ndarray, np.ndarray]:
    """The angles (rad) and the total energy (J) after each of the steps."""
    model, data = compiled()
    model.opt.integrator = INTEGRATORS[name]
    model.opt.timestep = DURATION / count
    angles, energies = np.empty((count, 2)), np.empty(count)
    for i in range(count):
        mujoco.mj_step(model, data)
        angles[i], energies[i] = data.qpos, data.energy.sum()
    return angles, energies


def reference() -> tuple[np.ndarray, float]:
    """The last angles, and the energy at the start: RK4 with four times the steps."""
    model, data = compiled()
    start = float(data.energy.sum())
    angles, _ = run("RK4", 4 * STEPS[-1])
    return angles[-1], start


def main() -> None:
    """Print, for each integrator and number of steps, the error of the angles and the energy."""
    model, _ = compiled()
    print("masses: " + "  ".join(f"{mass:.4f}" for mass in model.body_mass[1:]))
    target, start = reference()
    print("at the end: " + "  ".join(f"{angle:.4f}" for angle in target))
    for name in INTEGRATORS:
        for count in STEPS:
            angles, energies = run(name, count)
            error = np.abs(angles[-1] - target).max()
            print(f"{name:<12} {count:5d} steps  error {error:.2e}", end="")
            print(f"  energy {energies[0] / start:.3f} to {energies[-1] / start:.3f} of the first")


if __name__ == "__main__":
    main()
'''


def make_script(lesson: int, topic: Topic, title: str, kind: str) -> Script:
    """The script of a lesson; its kind is "python" or "mujoco"."""
    path = f"examples/l{lesson + 1:04d}_{topic.raw('slug').replace('-', '_')}.py"
    numbers = integrate_numbers(lesson, topic) if kind == "python" else simulate_numbers(lesson)
    template = INTEGRATE if kind == "python" else SIMULATE
    code = Fill(template).substitute(numbers, path=path, title=title)
    return Script(path, code, run_code(code, path))


def duration_of(lesson: int) -> str:
    """How long the motion is followed, s."""
    return f"{1.5 + pick(lesson, 'duration', 90) / 100:.2f}"


def step_counts(lesson: int, base: int) -> tuple[int, ...]:
    """Three numbers of steps, each twice the one before."""
    count = base + 5 * pick(lesson, "steps", 6)
    return count, 2 * count, 4 * count


def integrate_numbers(lesson: int, topic: Topic) -> dict[str, str]:
    """The values to fill into the script that integrates."""
    constants = "\n".join(
        f"{name if len(name) == 1 and name.isupper() else name.upper()} = {value}"
        for name, value in topic.values.items()
    )
    return {
        "constants": constants,
        "duration": duration_of(lesson),
        "steps": ", ".join(map(str, step_counts(lesson, 30))),
        "state": topic.raw("state"),
        "start": topic.raw("code", "start"),
        "rates": topic.raw("code", "rates"),
        "exact": "\n" + topic.raw("code", "exact"),
    }


def simulate_numbers(lesson: int) -> dict[str, str]:
    """The values to fill into the script that simulates."""
    return {
        "duration": duration_of(lesson),
        "steps": ", ".join(map(str, step_counts(lesson, 300))),
        "density": str(600 + pick(lesson, "density", 900)),
        "upper": f"{0.3 + pick(lesson, 'upper', 40) / 100:.2f}",
        "lower": f"{0.2 + pick(lesson, 'lower', 40) / 100:.2f}",
        "damping": f"{0.001 * (1 + pick(lesson, 'damping', 30)):.3f}",
        "first": f"{0.4 + pick(lesson, 'first', 80) / 100:.2f}",
        "second": f"{pick(lesson, 'second', 60) / 100 - 0.3:.2f}",
    }


def run_code(code: str, path: str) -> str:
    """Run a script; gives its output."""
    stream = io.StringIO()
    with contextlib.redirect_stdout(stream):
        exec(compile(code, path, "exec"), {"__name__": "__main__"})
    return stream.getvalue()
