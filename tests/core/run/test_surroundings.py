"""Which packages scripts ask for, as their text says."""

from __future__ import annotations

from pathlib import Path

import pytest

from coursebuild.core.run.surroundings import wanted_packages


@pytest.mark.parametrize(
    ("code", "wanted"),
    [
        ("", ()),
        ("import numpy as np", ("numpy",)),
        ("from numpy.linalg import inv", ("numpy",)),
        ("import numpy as np\nnp.random.rand()", ("numpy", "numpy.random")),
        ("from numpy.random import default_rng", ("numpy", "numpy.random")),
        ("if x:\n    import os, mujoco as m", ("numpy", "mujoco")),
        ("import mjcourse", ("numpy",)),
        ("import beside", ("numpy", "mujoco")),
        ("import numpydoc, mujocox", ()),
        ('"""\nimport mujoco\n"""', ()),
        ("# import mujoco\nx = 'import numpy'", ()),
        ("import mujoco\ndef f(:", ()),
        ("import mujoco\0", ()),
    ],
)
def test_wanted_packages(tmp_path: Path, code: str, wanted: tuple[str, ...]) -> None:
    (tmp_path / "beside.py").write_text("import x, mujoco\n")
    (tmp_path / "x.py").write_text(code)
    assert wanted_packages([tmp_path / "none.py", tmp_path / "x.py"]) == wanted
