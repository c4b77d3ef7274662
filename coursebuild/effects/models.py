"""A model of the course, compiled in this process, for whoever measures it.

Entry point: `compiled_model(root, path, text)`.

That it compiles, and does not take the process along, was found out before by a child (`mjcf`).
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from coursebuild.effects.errors import EffectError
from coursebuild.effects.mjcf import readable_error


def compiled_model(root: Path, path: str, text: str) -> Any:
    """The `mjModel` of a text that stands, or would stand, at a path of the course.

    Its includes, meshes and textures are found from there.

    Raises:
        EffectError: it does not compile, or MuJoCo cannot be loaded.
    """
    try:
        import mujoco
    except ImportError as error:
        raise EffectError(f"MuJoCo cannot be loaded: {error}") from None
    place = str(root.resolve() / path)
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda _: None)  # it would be written into the working directory
    try:
        return mujoco.MjModel.from_xml_path(place, assets={place: text.encode()})
    except (ValueError, mujoco.FatalError, MemoryError) as error:
        message = readable_error(str(error).replace(f"{root.resolve()}/", ""))
        raise EffectError(f"{path} does not compile: {message}") from None
    finally:
        mujoco.set_mju_user_warning(before)
