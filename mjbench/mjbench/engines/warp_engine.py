"""MuJoCo Warp: MuJoCo in Warp, in 32 bits, on the processor and on the first CUDA device.

It was written for CUDA, where the launches of a step are recorded once and played back as a graph.
On the processor each is made by Python, in every step. Warp keeps the kernels that it has compiled,
so that the time for this is shorter where a like model ran before.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mjbench.engines.engine_trial import Engine, Variant
from mjbench.problem import Array

_FIELDS = ("qpos", "qvel", "act", "ctrl", "time", "qacc_warmstart")
"""All that the next step depends on, in the models of a course."""


class _WarpWorlds:
    """A batch on a device of Warp."""

    def __init__(self, model: Any, data: Any, velocities: Array, variant: Variant) -> None:
        import mujoco_warp
        import warp

        self._device = warp.get_device(variant.device)
        with warp.ScopedDevice(self._device):
            self._model = mujoco_warp.put_model(model)
            self._data = mujoco_warp.put_data(model, data, nworld=len(velocities))
            self._data.qvel.assign(velocities.astype(np.float32))
            self._beginning = {name: warp.clone(getattr(self._data, name)) for name in _FIELDS}
        self._graph: Any = None

    def advance(self, steps: int) -> None:
        import mujoco_warp
        import warp

        with warp.ScopedDevice(self._device):
            if self._device.is_cuda and self._graph is None:
                mujoco_warp.step(self._model, self._data)  # compiles, which no graph can hold
                self.reset()
                with warp.ScopedCapture() as capture:
                    mujoco_warp.step(self._model, self._data)
                self._graph = capture.graph
            for _ in range(steps):
                if self._graph is None:
                    mujoco_warp.step(self._model, self._data)
                else:
                    warp.capture_launch(self._graph)
            warp.synchronize_device(self._device)

    def command(self, control: tuple[float, ...]) -> None:
        table = np.broadcast_to(np.asarray(control, np.float32), self._data.ctrl.shape)
        self._data.ctrl.assign(np.ascontiguousarray(table))

    def reset(self) -> None:
        import warp

        for name, array in self._beginning.items():
            warp.copy(getattr(self._data, name), array)

    def state(self) -> tuple[Array, Array]:
        return (
            self._data.qpos.numpy()[0].astype(np.float64),
            self._data.qvel.numpy()[0].astype(np.float64),
        )


def variants(_: int) -> list[Variant]:
    """The processor, and the first CUDA device where there is one."""
    import warp

    return [
        Variant(device.alias, device.name if device.is_cuda else "", 32)
        for device in (warp.get_device("cpu"), *warp.get_cuda_devices()[:1])
    ]


ENGINES = {
    "warp": Engine(
        title="MuJoCo Warp",
        module="mujoco_warp",
        packages=("mujoco-warp", "warp-lang"),
        variants=variants,
        start=_WarpWorlds,
    )
}
