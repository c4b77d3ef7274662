"""The files that MuJoCo opens for a model are known, though it opens them in C.

Each case is a course of small files and a script. What is noted suffices: with these files alone
the script does the same. And it is needed: without any one of them it does not.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from coursebuild.core.model.results import ScriptJob, ScriptRun
from coursebuild.core.run.runner import ScriptServer, clean_environment
from support.model_files import TETRAHEDRON, png

pytestmark = pytest.mark.site


def obj(size: int) -> bytes:
    return TETRAHEDRON.replace("1 0 0", f"{size} 0 0").encode()


def mjcf(inside: str) -> bytes:
    return f"<mujoco>{inside}</mujoco>".encode()


def mesh(file: str, name: str = "t") -> str:
    return (
        f'<asset><mesh name="{name}" file="{file}"/></asset>'
        f'<worldbody><body><geom type="mesh" mesh="{name}"/></body></worldbody>'
    )


def step(seconds: float) -> bytes:
    return mjcf(f'<option timestep="{seconds}"/>')


SHOW = """
import hashlib
import mujoco
import numpy as np

def show(model):
    size = mujoco.mj_sizeModel(model)
    buffer = np.zeros(size, np.uint8)
    mujoco.mj_saveModel(model, None, buffer)
    print(hashlib.sha256(buffer.tobytes()).hexdigest(), model.opt.timestep)

load = mujoco.MjModel.from_xml_path
text = mujoco.MjModel.from_xml_string
Spec = mujoco.MjSpec
"""

M = "models/m.xml"
MESHDIR = '<compiler meshdir="meshes"/>'
SHAPES = '<worldbody><geom type="mesh" mesh="t"/><geom type="hfield" hfield="h"/></worldbody>'
SIDES = "right left up down front back"
CASES: dict[str, tuple[dict[str, bytes], str, set[str], set[str]]] = {
    # files, script, files noted that are there, files noted that are not
    "a model": ({M: step(0.5)}, f"show(load('{M}'))", {M}, set()),
    "by keyword": ({M: step(0.5)}, f"show(load(filename='{M}', assets=None))", {M}, set()),
    "from another folder": (
        {M: mjcf(mesh("t.obj")), "models/t.obj": obj(1)},
        "import os\nos.chdir('models')\nshow(load('m.xml'))",
        {M, "models/t.obj"},
        set(),
    ),
    "absolute": (
        {M: mjcf(mesh("t.obj")), "models/t.obj": obj(1)},
        f"import os\nshow(load(os.path.abspath('{M}')))",
        {M, "models/t.obj"},
        set(),
    ),
    "includes": (
        {
            M: mjcf('<include file="sub/a.xml"/><!-- <include file="no.xml"/> -->'),
            "models/sub/a.xml": mjcf('<include\n file = "b.xml" />'),
            "models/b.xml": step(0.25),
            "models/sub/b.xml": step(0.75),
        },
        f"show(load('{M}'))",
        {M, "models/sub/a.xml", "models/b.xml"},
        set(),
    ),
    "folders of assets": (
        {
            M: mjcf(
                '<compiler meshdir="meshes" texturedir="pictures/"/>'
                + '<asset><mesh name="t" file="t.obj"/><texture name="a" type="2d" file="a.png"/>'
                + '<hfield name="h" file="../h.png" size="1 1 1 .1"/></asset>'
                + SHAPES
            ),
            "models/meshes/t.obj": obj(1),
            "models/t.obj": obj(2),
            "models/pictures/a.png": png(1),
            "models/h.png": png(2),
        },
        f"show(load('{M}'))",
        {M, "models/meshes/t.obj", "models/pictures/a.png", "models/h.png"},
        set(),
    ),
    "a cube of textures": (
        {
            M: mjcf(
                '<asset><texture name="c" type="cube"'
                + "".join(
                    f' file{side}="{"abacab"[i]}.png"' for i, side in enumerate(SIDES.split())
                )
                + "/></asset>"
            ),
            **{f"models/{name}.png": png(i) for i, name in enumerate("abc")},
        },
        f"show(load('{M}'))",
        {M, "models/a.png", "models/b.png", "models/c.png"},
        set(),
    ),
    "strippath": (
        {
            M: mjcf('<compiler strippath="true" assetdir="d"/>' + mesh("x/y/t.obj")),
            "models/d/t.obj": obj(1),
        },
        f"show(load('{M}'))",
        {M, "models/d/t.obj"},
        set(),
    ),
    "a compiler in an include": (
        {
            M: mjcf(mesh("t.obj") + '<include file="c.xml"/>'),
            "models/c.xml": mjcf('<compiler meshdir="d"/>'),
            "models/d/t.obj": obj(1),
        },
        f"show(load('{M}'))",
        {M, "models/c.xml", "models/d/t.obj"},
        set(),
    ),
    "a flexible body": (
        {
            M: mjcf(
                '<compiler assetdir="d"/><worldbody><flexcomp name="f" type="mesh" file="t.obj"'
                ' dim="2" rigid="true"/></worldbody>'
            ),
            "models/d/t.obj": obj(1),
        },
        f"show(load('{M}'))",
        {M, "models/d/t.obj"},
        {"models/t.obj"},
    ),
    "a model in a model": (
        {
            M: mjcf(
                '<asset><model name="c" file="child.xml"/></asset>'
                '<worldbody><attach model="c" body="b" prefix="p"/></worldbody>'
            ),
            "models/child.xml": mjcf(
                '<compiler meshdir="d"/><asset><mesh name="q" file="q.obj"/></asset>'
                '<worldbody><body name="b"><geom type="mesh" mesh="q"/></body></worldbody>'
            ),
            "models/d/q.obj": obj(1),
        },
        f"show(load('{M}'))",
        {M, "models/child.xml", "models/d/q.obj"},
        {"child.xml"},
    ),
    "a text": (
        {"meshes/t.obj": obj(1)},
        f"show(text({mjcf(MESHDIR + mesh('t.obj')).decode()!r}))",
        {"meshes/t.obj"},
        set(),
    ),
    "a text with an include": (
        {"models/a.xml": step(0.5)},
        "show(text('<mujoco><include file=\"models/a.xml\"/></mujoco>'))",
        {"models/a.xml"},
        set(),
    ),
    "assets handed over": (
        {M: mjcf(mesh("t.obj")), "models/t.obj": obj(1), "other/t.obj": obj(3)},
        f"show(load('{M}', {{'t.obj': open('other/t.obj', 'rb').read()}}))",
        {M, "other/t.obj"},
        set(),
    ),
    "an include handed over": (
        {M: mjcf('<include file="a.xml"/>'), "models/a.xml": step(0.5)},
        f"show(load('{M}', assets={{'a.xml': b'<mujoco><option timestep=\"2\"/></mujoco>'}}))",
        {M},
        set(),
    ),
    "a binary": (
        {},
        "import os\nname = os.environ['TMPDIR'] + '/m.mjb'\n"
        "mujoco.mj_saveModel(text('<mujoco/>'), name)\n"
        "show(mujoco.MjModel.from_binary_path(name))",
        set(),
        set(),
    ),
    "a spec": (
        {M: mjcf('<compiler meshdir="d"/>' + mesh("t.obj")), "models/d/t.obj": obj(1)},
        f"show(Spec.from_file('{M}').compile())",
        {M, "models/d/t.obj"},
        set(),
    ),
    "a spec that is not compiled": (
        {M: mjcf(mesh("t.obj") + '<include file="a.xml"/>'), "models/a.xml": step(0.5)},
        f"print(Spec.from_file('{M}').option.timestep)",
        {M, "models/a.xml"},
        set(),
    ),
    "a spec from a text": (
        {"t.obj": obj(1)},
        f"show(Spec.from_string({mjcf(mesh('t.obj')).decode()!r}).compile())",
        {"t.obj"},
        set(),
    ),
    "a spec made by hand": (
        {"d/t.obj": obj(1), "d/u.obj": obj(2)},
        "spec = Spec()\nspec.meshdir = 'd'\nm = spec.add_mesh(name='t', file='u.obj')\n"
        "m.file = 't.obj'\nspec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname='t')\n"
        "show(spec.compile())",
        {"d/t.obj"},
        set(),
    ),
    "a spec attached": (
        {"a/m.xml": mjcf('<compiler meshdir="d"/>' + mesh("t.obj")), "a/d/t.obj": obj(1)},
        "child = Spec.from_file('a/m.xml')\nparent = Spec()\n"
        "parent.attach(child, frame=parent.worldbody.add_frame(), prefix='p')\n"
        "show(parent.compile())",
        {"a/m.xml", "a/d/t.obj"},
        {"t.obj"},
    ),
    "a spec recompiled": (
        {"t.obj": obj(1), "u.obj": obj(2)},
        f"spec = Spec.from_string({mjcf(mesh('t.obj')).decode()!r})\nmodel = spec.compile()\n"
        "data = mujoco.MjData(model)\nspec.meshes[0].file = 'u.obj'\n"
        "show(spec.recompile(model, data)[0])",
        {"t.obj", "u.obj"},
        set(),
    ),
    "what is missing": (
        {M: mjcf(mesh("t.obj"))},
        f"try: load('{M}')\nexcept ValueError as error: print(error)",
        {M},
        {"models/t.obj"},
    ),
    "a model that is missing": (
        {},
        f"try: load('{M}')\nexcept ValueError as error: print(error)",
        set(),
        {M},
    ),
    "no XML": (
        {M: b"<mujoco><include file='a.xml'/>"},
        f"try: load('{M}')\nexcept ValueError as error: print(error)",
        {M},
        {"models/a.xml"},
    ),
    "an include below an include": (
        {
            M: mjcf('<include file="sub/a.xml"/>'),
            "models/sub/a.xml": mjcf('<include file="b.xml"/>'),
            "models/models/sub/b.xml": step(0.25),
            "models/sub/b.xml": step(0.75),
        },
        f"show(load('{M}'))",
        {M, "models/sub/a.xml", "models/models/sub/b.xml"},
        {"models/b.xml"},
    ),
    "an include below an include, absolute": (
        {
            M: mjcf('<include file="sub/a.xml"/>'),
            "models/sub/a.xml": mjcf('<include file="d/b.xml"/>'),
            "models/sub/d/b.xml": step(0.75),
        },
        f"import os\nshow(load(os.path.abspath('{M}')))",
        {M, "models/sub/a.xml", "models/sub/d/b.xml"},
        {"models/d/b.xml"},
    ),
    "an include that is missing": (
        {M: mjcf('<include file="sub/a.xml"/>')},
        f"try: load('{M}')\nexcept ValueError as error: print(error)",
        {M},
        {"models/sub/a.xml"},
    ),
    "robots": (
        {
            "r/r.urdf": (
                b'<robot name="r"><mujoco><compiler meshdir="d" balanceinertia="true"/></mujoco>'
                b'<link name="a"/><joint name="j" type="revolute"><parent link="a"/>'
                b'<child link="l"/><axis xyz="0 0 1"/><limit lower="-1" upper="1"/></joint>'
                b'<link name="l"><inertial><mass value="1"/>'
                b'<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial><collision>'
                b'<geometry><mesh filename="x/q.obj"/></geometry></collision></link>'
                b"</robot>"
            ),
            "r/d/x/q.obj": obj(1),
        },
        "show(load('r/r.urdf'))",
        {"r/r.urdf", "r/d/x/q.obj"},
        set(),
    ),
}


def write(root: Path, files: dict[str, bytes]) -> None:
    for name, data in files.items():
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)


def run(server: ScriptServer, root: Path, script: str) -> ScriptRun:
    write(root, {"examples/x.py": (SHOW + script).encode()})
    (done,) = server.run(root, [ScriptJob("examples/x.py", (), 120.0, (), False)], parallel=1)
    return done


def noted(done: ScriptRun) -> set[str]:
    assert done.trace is not None
    return {name for name in done.trace.files if not name.endswith(".py")}


@pytest.mark.parametrize("name", CASES)
def test_the_files_of_a_model(name: str, tmp_path: Path, server: ScriptServer) -> None:
    files, script, there, missing = CASES[name]
    root = tmp_path / "course"
    write(root, files)
    done = run(server, root, script)
    assert (done.status, done.stderr) == (0, "")
    assert noted(done) == there | missing
    assert done.trace is not None and done.trace.opaque == ""

    alone = tmp_path / "alone"
    write(alone, {path: files[path] for path in there})
    assert run(server, alone, script).stdout == done.stdout, "what was noted does not suffice"

    for path in sorted(there):
        less = tmp_path / "less"
        shutil.copytree(root, less)
        (less / path).unlink()
        changed = run(server, less, script)
        assert (changed.status, changed.stdout) != (0, done.stdout), f"{path} is not needed"
        shutil.rmtree(less)


def test_files_that_mujoco_writes(tmp_path: Path, server: ScriptServer) -> None:
    code = "model = text('<mujoco/>')\n{}\n"
    for call in (
        "mujoco.mj_saveLastXML('out.xml', model)",
        "mujoco.mj_saveModel(model, 'out.mjb')",
        "mujoco.mj_printModel(model, 'out.txt')",
        "mujoco.mj_printData(model, mujoco.MjData(model), 'out.txt')",
        "Spec().to_file('out.xml')",
    ):
        done = run(server, tmp_path, code.format(call))
        assert done.trace is not None and done.trace.opaque == "it writes files of the project", (
            call
        )


def test_plugins_of_the_project(tmp_path: Path, server: ScriptServer) -> None:
    (tmp_path / "plugins").mkdir()
    done = run(server, tmp_path, "mujoco.mj_loadAllPluginLibraries('plugins')")
    assert done.trace is not None and done.trace.opaque == "it loads native code of the project"


def test_wrappers_look_like_what_they_wrap(tmp_path: Path, server: ScriptServer) -> None:
    code = (
        "for f in (load, text, Spec.from_file, Spec.compile, Spec().attach, mujoco.mj_saveModel):"
        "\n"
        "    print(f.__name__, f.__qualname__, f.__module__, f.__doc__)\n"
        "print(mujoco.mj_saveModel is mujoco._functions.mj_saveModel, Spec().compile.__self__)\n"
    )
    environment = clean_environment(os.environ)
    (tmp_path / "bare.py").write_text(SHOW + code)
    bare = subprocess.run(
        [sys.executable, tmp_path / "bare.py"], env=environment, capture_output=True, check=True
    )
    addresses = re.compile(r" at 0x\w+")
    expected = addresses.sub("", bare.stdout.decode())
    assert addresses.sub("", run(server, tmp_path, code).stdout) == expected
