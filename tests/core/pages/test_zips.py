"""Archives of scripts: complete, exact versions, the same bytes, and what is in them runs."""

from __future__ import annotations

import io
import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Any

import pytest
from msgspec.structs import replace

from coursebuild.core.model import MjcfModel
from coursebuild.core.model.results import CompileResult, ModelFacts, OutputFile
from coursebuild.core.pages.listings import find_imports
from coursebuild.core.pages.zips import Package, Surroundings, make_archives
from coursebuild.core.text.source import Source
from support.rendered_course import Make

LESSON = """```python file=examples/one.py
import json, sys
import numpy as np
import helper
from mjcourse import model_path
print(model_path("arm"))
```
"""
HELPER_LESSON = """```python file=examples/helper.py
import yaml.nodes
VALUE = 1
```

```python file=examples/three.py
import torch
import swing
import matplotlib.pyplot as plt
```
"""

LIBRARY = {
    "mjcourse": (OutputFile("mjcourse/__init__.py", b"import mujoco\n"),),
    "swing": (OutputFile("swing/__init__.py", b"import period\n"), OutputFile("swing/a.csv", b"1")),
    "period": (OutputFile("period.py", b"import scipy.special\nimport swing\n"),),
    "helper": (OutputFile("helper.py", b"a script of the course has this name"),),
}
SURROUNDINGS = Surroundings(
    packages=(Package("numpy", "numpy", "2.4.6"), Package("yaml", "PyYAML", "6.0.3")),
    library=lambda name: LIBRARY.get(name, ()),
    model_files=(OutputFile("models/meshes/hand.obj", b"v 0 0 0\n"),),
    style=(OutputFile("matplotlibrc", b"font.size: 11\n"),),
)


@pytest.fixture
def rendered(make: Make) -> Any:
    rendered = make(LESSON, **{"1.1": HELPER_LESSON})
    facts = ModelFacts(1, 1, 0, 0, 0, 0, 0.002, "Euler", 1.0, (), (), (),
                       ("models/part.xml", "models/meshes/hand.obj"))  # fmt: skip
    models = tuple(
        MjcfModel(name, Source(f"models/{name}.xml", f"<mujoco model='{name}'/>\n"))
        for name in ("arm", "part", "box")
    )
    results = replace(rendered.results, models=(("arm", CompileResult("", None, facts)),))
    return replace(rendered, course=replace(rendered.course, models=models), results=results)


def packed_archives(rendered: Any) -> dict[str, bytes]:
    library = rendered.library()
    return {archive.path: archive.pack() for archive in make_archives(library, SURROUNDINGS)}


def open_archives(rendered: Any) -> dict[str, zipfile.ZipFile]:
    return {
        path: zipfile.ZipFile(io.BytesIO(data)) for path, data in packed_archives(rendered).items()
    }


def test_the_course_archive_has_scripts_models_library_and_requirements(rendered: Any) -> None:
    archive = open_archives(rendered)["examples.zip"]
    assert archive.namelist() == [
        "bodies-axes/README.md",
        "bodies-axes/examples/helper.py",
        "bodies-axes/examples/mjcourse/__init__.py",
        "bodies-axes/examples/one.py",
        "bodies-axes/examples/period.py",
        "bodies-axes/examples/swing/__init__.py",
        "bodies-axes/examples/swing/a.csv",
        "bodies-axes/examples/three.py",
        "bodies-axes/matplotlibrc",
        "bodies-axes/models/arm.xml",
        "bodies-axes/models/meshes/hand.obj",
        "bodies-axes/models/part.xml",
        "bodies-axes/requirements.txt",
    ]
    assert archive.read("bodies-axes/requirements.txt").decode() == (
        "PyYAML==6.0.3\nmatplotlib\nmujoco==3.14.0\nnumpy==2.4.6\nscipy\ntorch\n"
    )
    readme = archive.read("bodies-axes/README.md").decode()
    assert readme.startswith("# Bodies & <axes>: scripts\n")
    assert "python examples/one.py\n" in readme
    assert find_imports("from . import x\nfrom a.b import c\nimport d.e as f\n") == {"a", "d"}
    assert find_imports("import (\n") == frozenset()


def test_a_lesson_archive_has_what_its_scripts_import(rendered: Any) -> None:
    by_path = open_archives(rendered)
    names = by_path["lessons/0.1-falling.zip"].namelist()
    assert "0.1-falling/examples/helper.py" in names
    assert [n for n in names if "three" in n or "swing" in n or "matplotlibrc" in n] == []
    spinning = by_path["lessons/1.1-spinning.zip"]
    assert [name for name in spinning.namelist() if "models" in name or "mjcourse" in name] == []
    requirements = spinning.read("1.1-spinning/requirements.txt").decode().split()
    assert requirements == ["PyYAML==6.0.3", "matplotlib", "scipy", "torch"]


def test_the_bytes_depend_on_the_content_alone(rendered: Any) -> None:
    assert packed_archives(rendered) == packed_archives(rendered)
    for archive in open_archives(rendered).values():
        assert {entry.date_time for entry in archive.infolist()} == {(1980, 1, 1, 0, 0, 0)}
        assert {entry.external_attr >> 16 for entry in archive.infolist()} == {0o100644}
        assert archive.testzip() is None


@pytest.mark.site
def test_an_unpacked_script_finds_its_library_and_its_models(make: Make, tmp_path: Path) -> None:
    text = """```python file=examples/a.py
from mjcourse import model_path, spatial
path = (lambda name: model_path(name))("box")
print(path.read_text().strip().splitlines()[0], spatial.__name__)
```
"""
    site = make(text).site()
    zipfile.ZipFile(io.BytesIO(site["examples.zip"])).extractall(tmp_path)
    command = [sys.executable, "-I", "-c", RUNNER]
    folder = tmp_path / "bodies-axes"
    process = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert (process.stdout, process.stderr) == ('<mujoco model="box"> mjcourse.spatial\n', "")


RUNNER = """
import runpy, sys
sys.path[:0] = ["examples"]
runpy.run_path("examples/a.py", run_name="__main__")
"""
