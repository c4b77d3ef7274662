"""What of a model somebody looks at: lessons, scripts, labs, what is declared beside the model.

Entry point: `Readers`.

Nobody's code is understood here; it is searched for words, and where in doubt a thing counts as
read: whoever mentions `sensordata` reads every sensor, whoever lists sensors too.
"""

from __future__ import annotations

import re
from collections.abc import Iterable

from msgspec import Struct

_ALL: dict[str, tuple[str, ...]] = {
    kind: tuple(words.split())
    for kind, words in {
        "sensor": (
            r"sensordata nsensordata nsensor sensor_adr sensor_dim sensor_type sensor_name "
            r"""sensors mj_id2name id2name sensor\(\s*[^'\"\s] rollout"""
        ),
        "actuator": (
            r"ctrl nu qfrc_actuator actuator_force actuator_length actuator_velocity actuators "
            r"""mj_id2name actuator\(\s*[^'\"\s] set_mjcb_control rollout"""
        ),
        "tendon": (
            r"ten_length ten_velocity ten_J ten_wrapnum wrap_xpos ntendon tendons "
            r"""tendon\(\s*[^'\"\s]"""
        ),
        "keyframe": r"""nkey key_qpos key_qvel key_ctrl "key"\s*:\s*\d spec\.keys\b""",
        "keyframe-number": r"mj_resetDataKeyframe\([^,()]*,[^,()]*,\s*\d",
        "site": r"""site_xpos site_pos nsite site_xmat sites \bsite\(\s*[^'\"\s]""",
        "material": (r"""mat_rgba nmat materials \bmat\(\s*[^'\"\s] \bmaterial\(\s*[^'\"\s]"""),
        "texture": "tex_data ntex textures",
        "mesh": r"""nmesh mesh_vert mesh_face mesh_pos meshes \bmesh\(\s*[^'\"\s]""",
        "hfield": r"""hfield_data nhfield hfields \bhfield\(\s*[^'\"\s]""",
        "energy": "energy Energy",
        "fwdinv": "solver_fwdinv mj_compareFwdInv",
        "number": (
            "qpos qvel qacc nq nv nbody ngeom xpos xquat xipos geom_xpos body_mass cvel rollout"
        ),
        "body-number": "nbody ngeom xpos xipos geom_xpos body_mass cvel bodies",
        "shape": (
            "body_pos body_quat geom_pos geom_quat geom_size geom_margin jnt_range jnt_pos "
            "jnt_limited contype conaffinity geom_contype geom_conaffinity disableflags "
            "MjSpec mjs_addGeom"
        ),
    }.items()
}
"""Who says one of these reads all of a kind, or may; what has a backslash is a pattern."""
_WORD = r"(?<![\w]){}(?![\w])"
_UNNAMED = r"(?<![\w])(?<!\)\.){}(?![\w])"
"""A word that is not asked of one thing, as in `data.joint("pivot").qpos`."""


class Reader(Struct, frozen=True):
    """A file that uses the model."""

    path: str
    text: str


class Readers(Struct, frozen=True):
    """All files that use a model."""

    files: tuple[Reader, ...] = ()

    def whole(self, what: str) -> str:
        """Who reads all of a kind, or may: the path of the first; empty where nobody does."""
        word_shape = _UNNAMED if "number" in what else _WORD
        shapes = [
            re.compile(word if "\\" in word else word_shape.format(word)) for word in _ALL[what]
        ]
        for file in self.files:
            if any(shape.search(file.text) for shape in shapes):
                return file.path
        return ""

    def named(self, name: str) -> str:
        """Who mentions a name: the path of the first; empty where nobody does."""
        if not name:
            return ""
        shape = re.compile(_WORD.format(re.escape(name)))
        return next((file.path for file in self.files if shape.search(file.text)), "")

    def reads(self, what: str, name: str) -> bool:
        """Whether a thing of this kind and name is read, or may be."""
        return bool(self.whole(what) or self.named(name))


def readers_of(model: str, files: Iterable[Reader]) -> Readers:
    """The files that use a model, given by its name: those that mention it.

    Who puts names of models together, or lists their folder, may use any.
    """
    last = model.rpartition("/")[2]
    mention = re.compile(_WORD.format(re.escape(last)))
    any_model = re.compile(
        r"(?:glob|iterdir|listdir|scandir)\(|\{\w*\}(?:\.xml|['\"`])|\+\s*['\"`]\.xml"
    )
    about = re.compile(r"models?\b")
    return Readers(
        tuple(
            file
            for file in files
            if mention.search(file.text)
            or (any_model.search(file.text) and about.search(file.text))
        )
    )
