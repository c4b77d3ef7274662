# /// script
# requires-python = ">=3.11"
# dependencies = [
#     "mujoco==MUJOCO",
# ]
# ///
import mujoco

import tempfile
from pathlib import Path

MODELS = {
    "box.xml": """\
<mujoco model="box">
  <option timestep="0.002"/>
  <worldbody>
    <geom type="plane" size="1 1 .1"/>
    <body name="box" pos="0 0 1">
      <freejoint/>
      <geom type="box" size=".1 .1 .1" mass="1"/>
    </body>
  </worldbody>
  <keyframe>
    <key name="high" qpos="0 0 3 1 0 0 0"/>
  </keyframe>
</mujoco>
""",
}
_folder = tempfile.TemporaryDirectory()


def model_path(name):
    """The path of one of the MODELS, which it writes into a temporary folder."""
    for file, text in MODELS.items():
        path = Path(_folder.name, file)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return Path(_folder.name, name.removesuffix(".xml") + ".xml")


model = mujoco.MjModel.from_xml_path(str(model_path("box")))
print(model.nbody, model.body_mass[1])
