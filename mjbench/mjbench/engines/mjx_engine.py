"""MJX: MuJoCo in JAX (`impl="jax"`), in 32 and 64 bits, on the processor and JAX's first device."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np

from mjbench.engines.engine_trial import Engine, Variant
from mjbench.problem import Array


class _BatchedWorlds:
    """A batch that one compiled function advances."""

    def __init__(self, model: Any, data: Any, velocities: Array, variant: Variant) -> None:
        from mujoco import mjx

        jax: Any = importlib.import_module("jax")
        jax.config.update("jax_enable_x64", variant.bits == 64)
        self._device = jax.devices(variant.device)[0]
        count = len(velocities)
        with jax.default_device(self._device):
            self._model = mjx.put_model(model, device=self._device, impl="jax")
            world = mjx.put_data(model, data, device=self._device, impl="jax")
            batch = jax.tree.map(
                lambda leaf: jax.numpy.broadcast_to(leaf, (count, *jax.numpy.shape(leaf))), world
            )
            batch = batch.replace(qvel=jax.numpy.asarray(velocities, dtype=world.qvel.dtype))
            step = jax.vmap(mjx.step, in_axes=(None, 0))
            # A loop needs the types of a step's results: in 64 bits some are other ones than those
            # of `put_data`. Placed as results are: a function is compiled again for what is placed
            # otherwise.
            types = jax.eval_shape(step, self._model, batch)
            batch = jax.tree.map(lambda leaf, result: leaf.astype(result.dtype), batch, types)
            self._beginning = self._batch = jax.device_put(batch, self._device)

            def advance(model: Any, batch: Any, steps: Any) -> Any:
                return jax.lax.fori_loop(0, steps, lambda _, state: step(model, state), batch)

            self._advance = jax.jit(advance)

    def advance(self, steps: int) -> None:
        jax: Any = importlib.import_module("jax")
        with jax.default_device(self._device):
            self._batch = jax.block_until_ready(self._advance(self._model, self._batch, steps))

    def command(self, control: tuple[float, ...]) -> None:
        import jax

        before = self._batch.ctrl
        table = np.broadcast_to(np.asarray(control, before.dtype), before.shape)
        self._batch = self._batch.replace(ctrl=jax.device_put(table, self._device))

    def reset(self) -> None:
        self._batch = self._beginning

    def state(self) -> tuple[Array, Array]:
        return (
            np.asarray(self._batch.qpos[0], dtype=np.float64),
            np.asarray(self._batch.qvel[0], dtype=np.float64),
        )


def variants(_: int) -> list[Variant]:
    """The processor, and the accelerator that JAX prefers, each in 32 and in 64 bits."""
    import jax

    devices = {device.platform: device for device in (*jax.devices("cpu")[:1], *jax.devices()[:1])}
    return [
        Variant(platform, "" if platform == "cpu" else device.device_kind, bits)
        for platform, device in devices.items()
        for bits in (32, 64)
    ]


ENGINES = {
    "mjx": Engine(
        title="MJX",
        module="mujoco.mjx",
        packages=("mujoco-mjx", "jax"),
        variants=variants,
        start=_BatchedWorlds,
    )
}
