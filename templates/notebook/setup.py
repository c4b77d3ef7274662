"""Write what the scripts need beside this notebook, and make the magic %%example."""

import base64
import importlib.util
import io
import os
import pathlib
import shlex
import subprocess
import sys
import threading
import zipfile

from IPython.core.magic import no_var_expand, register_cell_magic

FILES = ""
ELSEWHERE = ()
CONDITIONS = {
    "PYTHONHASHSEED": "0", "PYTHONUTF8": "1", "PYTHONUNBUFFERED": "1", "TZ": "UTC",
    "PYTHONDONTWRITEBYTECODE": "1", "NO_COLOR": "1", "TERM": "dumb", "MPLBACKEND": "Agg",
    "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1",
}  # under which outputs were recorded


def unpack():
    """Write the files that are not there."""
    with zipfile.ZipFile(io.BytesIO(base64.b64decode(FILES))) as archive:
        for name in archive.namelist():
            path, data = pathlib.Path(name), archive.read(name)
            if not path.exists():
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(data)
            elif path.read_bytes() != data:
                print(f"{name} is there and is another than this lesson's: it is left as it is")


def copy(source, target):
    for line in source:
        target.write(line)


def run(name, arguments):
    """Run a script, its output shown as it comes."""
    command = [sys.executable, name, *arguments]
    environment = {**os.environ, **CONDITIONS}
    pipe = subprocess.PIPE
    with subprocess.Popen(
        command, env=environment, stdin=subprocess.DEVNULL, stdout=pipe, stderr=pipe,
        encoding="utf-8", errors="replace",
    ) as process:
        errors = threading.Thread(target=copy, args=(process.stderr, sys.stderr))
        errors.start()
        try:
            copy(process.stdout, sys.stdout)
            process.wait()
        except BaseException:
            process.kill()
            raise
        finally:
            errors.join()
    if process.returncode:
        raise RuntimeError(f"{name} ended with status {process.returncode}")


@register_cell_magic
@no_var_expand
def example(line, cell):
    """Write the cell to the file that the line names, and run it with the words after the name."""
    words = shlex.split(line)
    options = {}
    while words and words[0].startswith("--"):
        option, _, value = words.pop(0).partition("=")
        options[option] = value
    name, *arguments = words
    path = pathlib.Path(name)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes((cell.rstrip("\n") + "\n").encode())
    needed = filter(None, options.get("--requires", "").split(","))
    missing = [one for one in needed if importlib.util.find_spec(one.partition(".")[0]) is None]
    if missing:
        print(f"{name} is not run: it needs {', '.join(missing)}")
    elif "--norun" not in options:
        run(name, arguments)


if FILES:
    unpack()
for name in ELSEWHERE:
    if not pathlib.Path(name).exists():
        raise FileNotFoundError(f"{name} is not there: unpack the lesson's archive here")
sys.path.insert(0, os.path.abspath("examples"))
