import subprocess
import sys
from pathlib import Path

import pytest

import mjcourse

PACKAGE = Path(mjcourse.__file__).parent


@pytest.mark.site
def test_importing_mjcourse_loads_numpy_and_nothing_else_that_is_installed() -> None:
    code = (
        "import sys; before = set(sys.modules)\n"
        "import mjcourse, mjcourse.spatial\n"
        "names = {name.partition('.')[0] for name in set(sys.modules) - before}\n"
        "print(*sorted(names - sys.stdlib_module_names))"
    )
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", code],
        cwd=PACKAGE.parent,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    # NumPy registers some of its compiled modules under top-level names of its own.
    loaded = [name for name in done.stdout.split() if not name.startswith("_")]
    assert loaded == ["mjcourse", "numpy"]
