import pytest

from support.run_code import run_code


@pytest.mark.site
def test_importing_mjcourse_loads_numpy_and_nothing_else_that_is_installed() -> None:
    code = (
        "import sys; before = set(sys.modules)\n"
        "import mjcourse, mjcourse.spatial\n"
        "names = {name.partition('.')[0] for name in set(sys.modules) - before}\n"
        "print(*sorted(names - sys.stdlib_module_names))"
    )
    process = run_code(code, PYTHONWARNINGS="error")
    assert process.returncode == 0, process.stderr
    # NumPy registers some of its compiled modules under top-level names of its own.
    modules = [name for name in process.stdout.split() if not name.startswith("_")]
    assert modules == ["mjcourse", "numpy"]
