"""The files that MuJoCo opens for a model are known, though it opens them in C.

Each case is a course of small files and a script. What is noted suffices: with these files alone
the script does the same. And it is needed: without any one of them it does not.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import pytest

from coursebuild.core.model.results import ScriptJob, ScriptRun
from coursebuild.core.run.script_environment import clean_environment
from coursebuild.core.run.script_server import ScriptServer
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


class Case(NamedTuple):
    """Files of a course, and a script that loads a model."""

    files: dict[str, bytes]
    script: str = "show(load('models/m.xml'))"
    spare: str = ""
    """The file that MuJoCo does not look for."""
    missing: str = ""
    """A further file that it looks for in vain."""


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
TRY = f"try: load('{M}')\nexcept ValueError as error: print(error)"
SIDES = "right left up down front back"
CASES = {
    "a model": Case({M: step(0.5)}),
    "by keyword": Case({M: step(0.5)}, f"show(load(filename='{M}', assets=None))"),
    "from another folder": Case(
        {M: mjcf(mesh("t.obj")), "models/t.obj": obj(1)},
        "import os\nos.chdir('models')\nshow(load('m.xml'))",
    ),
    "absolute": Case(
        {M: mjcf(mesh("t.obj")), "models/t.obj": obj(1)},
        f"import os\nshow(load(os.path.abspath('{M}')))",
    ),
    "includes": Case(
        {
            M: mjcf('<include file="sub/a.xml"/><!-- <include file="no.xml"/> -->'),
            "models/sub/a.xml": mjcf('<include\n file = "b.xml" />'),
            "models/b.xml": step(0.25),
            "models/sub/b.xml": step(0.75),
        },
        spare="models/sub/b.xml",
    ),
    "folders of assets": Case(
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
        spare="models/t.obj",
    ),
    "a cube of textures": Case(
        {
            M: mjcf(
                '<asset><texture name="c" type="cube"'
                + "".join(
                    f' file{side}="{"abacab"[i]}.png"' for i, side in enumerate(SIDES.split())
                )
                + "/></asset>"
            ),
            **{f"models/{name}.png": png(i) for i, name in enumerate("abc")},
        }
    ),
    "strippath": Case(
        {
            M: mjcf('<compiler strippath="true" assetdir="d"/>' + mesh("x/y/t.obj")),
            "models/d/t.obj": obj(1),
        }
    ),
    "a compiler in an include": Case(
        {
            M: mjcf(mesh("t.obj") + '<include file="c.xml"/>'),
            "models/c.xml": mjcf('<compiler meshdir="d"/>'),
            "models/d/t.obj": obj(1),
        }
    ),
    "a flexible body": Case(
        {
            M: mjcf(
                '<compiler assetdir="d"/><worldbody><flexcomp name="f" type="mesh" file="t.obj"'
                ' dim="2" rigid="true"/></worldbody>'
            ),
            "models/d/t.obj": obj(1),
        },
        missing="models/t.obj",
    ),
    "a model in a model": Case(
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
        missing="child.xml",
    ),
    "a text": Case(
        {"meshes/t.obj": obj(1)}, f"show(text({mjcf(MESHDIR + mesh('t.obj')).decode()!r}))"
    ),
    "a text with an include": Case(
        {"models/a.xml": step(0.5)},
        "show(text('<mujoco><include file=\"models/a.xml\"/></mujoco>'))",
    ),
    "assets handed over": Case(
        {M: mjcf(mesh("t.obj")), "models/t.obj": obj(1), "other/t.obj": obj(3)},
        f"show(load('{M}', {{'t.obj': open('other/t.obj', 'rb').read()}}))",
        spare="models/t.obj",
    ),
    "an include handed over": Case(
        {M: mjcf('<include file="a.xml"/>'), "models/a.xml": step(0.5)},
        f"show(load('{M}', assets={{'a.xml': b'<mujoco><option timestep=\"2\"/></mujoco>'}}))",
        spare="models/a.xml",
    ),
    "a binary": Case(
        {},
        "import os\nname = os.environ['TMPDIR'] + '/m.mjb'\n"
        "mujoco.mj_saveModel(text('<mujoco/>'), name)\n"
        "show(mujoco.MjModel.from_binary_path(name))",
    ),
    "a spec": Case(
        {M: mjcf('<compiler meshdir="d"/>' + mesh("t.obj")), "models/d/t.obj": obj(1)},
        f"show(Spec.from_file('{M}').compile())",
    ),
    "a spec that is not compiled": Case(
        {M: mjcf(mesh("t.obj") + '<include file="a.xml"/>'), "models/a.xml": step(0.5)},
        f"print(Spec.from_file('{M}').option.timestep)",
    ),
    "a spec from a text": Case(
        {"t.obj": obj(1)}, f"show(Spec.from_string({mjcf(mesh('t.obj')).decode()!r}).compile())"
    ),
    "a spec made by hand": Case(
        {"d/t.obj": obj(1), "d/u.obj": obj(2)},
        "spec = Spec()\nspec.meshdir = 'd'\nm = spec.add_mesh(name='t', file='u.obj')\n"
        "m.file = 't.obj'\nspec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname='t')\n"
        "show(spec.compile())",
        spare="d/u.obj",
    ),
    "a spec attached": Case(
        {"a/m.xml": mjcf('<compiler meshdir="d"/>' + mesh("t.obj")), "a/d/t.obj": obj(1)},
        "child = Spec.from_file('a/m.xml')\nparent = Spec()\n"
        "parent.attach(child, frame=parent.worldbody.add_frame(), prefix='p')\n"
        "show(parent.compile())",
        missing="t.obj",
    ),
    "a spec recompiled": Case(
        {"t.obj": obj(1), "u.obj": obj(2)},
        f"spec = Spec.from_string({mjcf(mesh('t.obj')).decode()!r})\nmodel = spec.compile()\n"
        "data = mujoco.MjData(model)\nspec.meshes[0].file = 'u.obj'\n"
        "show(spec.recompile(model, data)[0])",
    ),
    "what is missing": Case({M: mjcf(mesh("t.obj"))}, TRY, missing="models/t.obj"),
    "a model that is missing": Case({}, TRY, missing="models/m.xml"),
    "no XML": Case({M: b"<mujoco><include file='a.xml'/>"}, TRY, missing="models/a.xml"),
    "an include below an include": Case(
        {
            M: mjcf('<include file="sub/a.xml"/>'),
            "models/sub/a.xml": mjcf('<include file="b.xml"/>'),
            "models/models/sub/b.xml": step(0.25),
            "models/sub/b.xml": step(0.75),
        },
        spare="models/sub/b.xml",
        missing="models/b.xml",
    ),
    "an include below an include, absolute": Case(
        {
            M: mjcf('<include file="sub/a.xml"/>'),
            "models/sub/a.xml": mjcf('<include file="d/b.xml"/>'),
            "models/sub/d/b.xml": step(0.75),
        },
        f"import os\nshow(load(os.path.abspath('{M}')))",
        missing="models/d/b.xml",
    ),
    "an include that is missing": Case(
        {M: mjcf('<include file="sub/a.xml"/>')}, TRY, missing="models/sub/a.xml"
    ),
    "robots": Case(
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
    ),
}


def write(root: Path, files: dict[str, bytes]) -> None:
    for name, data in files.items():
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)


def run(server: ScriptServer, root: Path, script: str) -> ScriptRun:
    write(root, {"examples/x.py": (SHOW + script).encode()})
    (result,) = server.run(root, [ScriptJob("examples/x.py", (), 120.0, ())], parallel=1)
    return result


def noted_files(result: ScriptRun) -> set[str]:
    assert result.trace is not None
    return {name for name in result.trace.files if not name.endswith(".py")}


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_the_files_of_a_model(case: Case, tmp_path: Path, server: ScriptServer) -> None:
    needed_files = case.files.keys() - {case.spare}
    root = tmp_path / "course"
    write(root, case.files)
    result = run(server, root, case.script)
    assert (result.status, result.stderr) == (0, "")
    assert noted_files(result) == needed_files | ({case.missing} - {""})
    assert result.trace is not None and result.trace.opaque == ""

    alone = tmp_path / "alone"
    write(alone, {path: case.files[path] for path in needed_files})
    assert run(server, alone, case.script).stdout == result.stdout, (
        "what was noted does not suffice"
    )

    for path in needed_files:
        (alone / path).unlink()
        changed_run = run(server, alone, case.script)
        assert (changed_run.status, changed_run.stdout) != (0, result.stdout), (
            f"{path} is not needed"
        )
        write(alone, {path: case.files[path]})


def test_files_that_mujoco_writes_and_plugins_that_it_loads(
    tmp_path: Path, server: ScriptServer
) -> None:
    (tmp_path / "plugins").mkdir()
    writes, loads = "it writes files of the project", "it loads native code of the project"
    for call, reason in {
        "mujoco.mj_saveLastXML('out.xml', model)": writes,
        "mujoco.mj_saveModel(model, 'out.mjb')": writes,
        "mujoco.mj_printModel(model, 'out.txt')": writes,
        "mujoco.mj_printData(model, mujoco.MjData(model), 'out.txt')": writes,
        "Spec().to_file('out.xml')": writes,
        "mujoco.mj_loadAllPluginLibraries('plugins')": loads,
    }.items():
        result = run(server, tmp_path, f"model = text('<mujoco/>')\n{call}\n")
        assert result.trace is not None and result.trace.opaque == reason, call


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
