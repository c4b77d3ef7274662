import subprocess
import sys
from pathlib import Path

import mjcourse

ROOT = Path(mjcourse.__file__).parents[1]


def python(code: str) -> str:
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", code],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_importing_mjcourse_loads_numpy_and_nothing_else_that_is_installed() -> None:
    loaded = python(
        "import sys; before = set(sys.modules)\n"
        "import mjcourse, mjcourse.spatial\n"
        "names = {name.partition('.')[0] for name in set(sys.modules) - before}\n"
        "print(*sorted(names - sys.stdlib_module_names))"
    )
    # NumPy registers some of its compiled modules under top-level names of its own.
    assert [name for name in loaded.split() if not name.startswith("_")] == ["mjcourse", "numpy"]


def test_names_of_the_package() -> None:
    python(
        "from mjcourse import model_path, spatial, ModelNotFoundError\n"
        "assert issubclass(ModelNotFoundError, FileNotFoundError)\n"
        "assert spatial.quat_to_mat([1, 0, 0, 0]).shape == (3, 3)\n"
    )
    assert (Path(mjcourse.__file__).parent / "py.typed").is_file()
