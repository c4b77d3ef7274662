import mujoco
from mjcourse import model_path

model = mujoco.MjModel.from_xml_path(str(model_path("box")))
print(model.nbody, model.body_mass[1])
