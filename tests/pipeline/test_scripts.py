"""What a script of a lesson sees, and how one that goes wrong is told, through the whole tool."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable

import pytest

from support.scratch_course import ROOT, Folder, block, wait_until_alone

pytestmark = pytest.mark.site

Make = Callable[..., Folder]

SEES = """
import json, locale, os, sys, time
from pathlib import Path
import helper
from sub.inner import DEEP

print(json.dumps({
    "name": __name__,
    "file": __file__,
    "argv": sys.argv,
    "path0": sys.path[0],
    "cwd": os.getcwd(),
    "helper": helper.WHAT,
    "deep": DEEP,
    "bytecode": sys.dont_write_bytecode,
    "encodings": [sys.stdout.encoding, locale.getpreferredencoding(), sys.getfilesystemencoding()],
    "tz": [time.tzname[0], time.timezone],
    "hash": hash("a fixed seed"),
    "stdin": sys.stdin.read(),
    "environ": sorted(os.environ),
    "threads": [os.environ[f"{n}_NUM_THREADS"] for n in ("OMP", "OPENBLAS", "MKL")],
    "annotations": __annotations__ if "__annotations__" in globals() else {},
}))
Path(os.environ["TMPDIR"], "scratch").write_text("gone afterwards")
"""


def test_what_a_script_sees(make: Make) -> None:
    lesson = (
        "## One\n\n"
        + block("helper.py", "WHAT = 'a sibling'")
        + block("sub/inner.py", "DEEP = 'in a folder'")
        + block("sees.py", SEES, "{}", info="args=\"--n 3 'two words' ü\"")
    )
    folder = make(lesson)
    odd = {"TZ": "Asia/Tokyo", "LANG": "tr_TR.UTF-8", "PYTHONHASHSEED": "7", "SECRET": "x"}
    odd |= {"OMP_NUM_THREADS": "9", "PYTHONPATH": str(ROOT), "PYTHONSTARTUP": "/no/such"}
    done = folder.run("update", env=odd)
    assert done.status == 0, done.out + done.err
    lines = folder.text(folder.lesson()).splitlines()
    saw = json.loads(lines[lines.index("Output:") + 3])
    environment = saw.pop("environ")
    assert not {"SECRET", "PYTHONSTARTUP"} & set(environment)
    root = str(folder.root)
    fixed = subprocess.run(
        [sys.executable, "-c", "print(hash('a fixed seed'))"],
        env={**os.environ, "PYTHONHASHSEED": "0"},
        capture_output=True,
        text=True,
    )
    assert saw == {
        "name": "__main__",
        "file": saw["file"],
        "argv": ["examples/sees.py", "--n", "3", "two words", "ü"],
        "path0": f"{root}/examples",
        "cwd": root,
        "helper": "a sibling",
        "deep": "in a folder",
        "bytecode": True,
        "encodings": ["utf-8", "utf-8", "utf-8"],
        "tz": ["UTC", 0],
        "hash": int(fixed.stdout),
        "stdin": "",
        "threads": ["1", "1", "1"],
        "annotations": {},
    }
    assert str(folder.root / saw["file"]) == f"{root}/examples/sees.py"
    assert [path.name for path in folder.tmp.iterdir()] == []
    assert not list(folder.root.rglob("__pycache__"))
    done = folder.run("check")
    assert done.status == 0, done.out  # under another environment it prints the same


def test_a_learner_runs_the_extracted_file(make: Make) -> None:
    code = "import sys\nfrom helper import WHAT\n\nprint(WHAT, sys.argv[1:])"
    lesson = block("helper.py", "WHAT = 1") + block("x.py", code, "1 ['a']", info="args=a")
    folder = make("## One\n\n" + lesson)
    assert folder.main("check").status == 0
    learner = subprocess.run(
        [sys.executable, "examples/x.py", "a"], cwd=folder.root, capture_output=True, text=True
    )
    assert learner.stdout == "1 ['a']\n"


def test_a_traceback_names_the_lesson(make: Make) -> None:
    code = "def f(x):\n    return 1 / x\n\n\nprint('before')\nf(0)"
    lesson = "## One\n\n- text\n\n> " + block("x.py", code).replace("\n", "\n> ")
    folder = make(lesson, lesson.replace("x.py", "y.py").replace("\n", "\r\n"))
    done = folder.main("check")
    assert done.status == 1
    lines = lesson.split("\n")
    division, call = lines.index(">     return 1 / x") + 1, lines.index("> f(0)") + 1
    for number, script in ((1, "x.py"), (2, "y.py")):
        path = folder.lesson(number)
        assert f"error[script-failed]: `examples/{script}` exited with status 1" in done.out
        assert f"--> {path}:{division}:" in done.out
        assert f'File "{path}", line {division}, in f' in done.out
        assert f'File "{path}", line {call}, in <module>' in done.out
    assert "ZeroDivisionError: division by zero" in done.out
    assert str(folder.root) not in done.out


WRONG = {
    "exit": ("import sys\nsys.exit('a reason')", "script-failed", "exited with status 1"),
    "status": ("raise SystemExit(77)", "script-failed", "exited with status 77"),
    "killed": ("import os\nos.kill(os.getpid(), 9)", "script-killed", "was ended by SIGKILL"),
    "crash": ("import os\nos.abort()", "script-killed", "was ended by SIGABRT"),
    "slow": ("import time\ntime.sleep(600)", "script-timeout", "was stopped after 0.4 s"),
    "deaf": (
        "import signal, time\n"
        "for n in (2, 6, 15):\n    signal.signal(n, signal.SIG_IGN)\n"
        "while True:\n    time.sleep(1)",
        "script-timeout",
        "was stopped after 0.4 s",
    ),
    "noisy": ("while True:\n    print('x' * 4000)", "script-output-limit", "more than 1 MiB"),
    "bytes": (
        "import sys\nsys.stdout.buffer.write(b'\\xff\\n')",
        "script-encoding",
        "not UTF-8",
    ),
    "silent": ("x = 1", "script-silent", "printed nothing"),
}


def test_every_way_to_go_wrong_is_told_in_one_run(make: Make) -> None:
    limits = {"slow": "timeout=0.4", "deaf": "timeout=0.4"}
    lesson = "## One\n\n" + "".join(
        block(f"{name}.py", code, "something", info=limits.get(name, ""))
        for name, (code, _, _) in WRONG.items()
    )
    folder = make(lesson)
    done = folder.main("check", "--format", "json")
    assert done.status == 1
    found = json.loads(done.out)
    told = [(d["rule"], d["message"]) for d in found["diagnostics"]]
    assert [rule for rule, _ in told] == [rule for _, rule, _ in WRONG.values()]
    for (_, message), (_, _, says) in zip(told, WRONG.values(), strict=True):
        assert says in message
    wait_until_alone(folder)


def test_what_a_script_leaves_running_is_ended(make: Make) -> None:
    code = """
import subprocess, sys, time
subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"], start_new_session=True)
subprocess.Popen(["sh", "-c", "(sleep 600 &) ; sleep 600"])
print("done")
"""
    folder = make("## One\n\n" + block("x.py", code, "done"))
    done = folder.main("check")
    assert done.status == 0, done.out
    wait_until_alone(folder)


def test_skipped_and_not_run_scripts_are_extracted_and_shown(make: Make) -> None:
    lesson = (
        "## One\n\n"
        + block("here.py", "print(1)", "1", info="requires=numpy,json.decoder,here")
        + block("gone.py", "import torchy", "2", info="requires=numpy,torchy,mjxy.sub")
        + block("never.py", "raise SystemExit(1)", info="norun")
    )
    folder = make(lesson)
    done = folder.main("build")
    assert done.status == 0, done.out
    shown = [line.split("  ")[-1] for line in done.out.splitlines()[1:3]]
    assert shown == ["(needs torchy, mjxy.sub)", "(not run)"]
    assert "1 lesson, 1 script run, 1 skipped: everything holds" in done.out
    assert set(folder.tree("examples")) == {".extracted.json", "gone.py", "here.py", "never.py"}
    page = folder.text("public/lessons/1.1-one.html")
    assert "torchy" in page and "never.py" in page


def test_a_model_of_the_course(make: Make) -> None:
    code = "from mjcourse import model_path\n\nprint(model_path('parts/ball').name)"
    folder = make("## One\n\n" + block("x.py", code, "ball.xml"))
    folder.write("models/parts/ball.xml", "<mujoco/>")
    done = folder.main("check")
    assert done.status == 0, done.out
    folder.replace(folder.lesson(), "parts/ball", "parts/bal")
    done = folder.main("check")
    assert done.status == 1
    assert "`parts/ball`" in done.out or "parts/ball" in done.out


def test_a_link_in_place_of_a_folder_is_not_followed(make: Make) -> None:
    folder = make("## One\n\n" + block("sub/x.py", "print(1)", "1"))
    outside = folder.root.parent / "outside"
    (outside / "sub").mkdir(parents=True)
    for link in (folder.root / "examples", folder.root / "examples/sub"):
        link.parent.mkdir(exist_ok=True)
        link.symlink_to(outside)
        done = folder.main("check")
        assert (done.status, "link" in done.out + done.err) == (1, True), link
        assert [path.name for path in outside.rglob("*")] == ["sub"]
        link.unlink()


# --- simulations that are lost

MODEL = """
<mujoco model="cart">
  <worldbody><body><joint type="slide" axis="1 0 0"/><geom size="1" mass="1"/></body></worldbody>
</mujoco>
"""
LOST = f"""
import mujoco

model = mujoco.MjModel.from_xml_string('''{MODEL}''')
data = mujoco.MjData(model)
data.qfrc_applied[0] = 1e15
mujoco.mj_step(model, data)
print("error", data.qpos[0])
"""


def test_lost_simulation_fails_every_command_unless_its_lesson_says_so(make: Make) -> None:
    def lesson(force: str, info: str = "", output: str = "error 0.0") -> str:
        return "## One\n\n" + block("a.py", LOST.replace("1e15", force), output, info=info)

    def rules() -> list[str]:
        found = json.loads(folder.main("check", "--format", "json").out)
        return [each["rule"] for each in found["diagnostics"]]

    folder = make(lesson("1e15"))
    first, again = folder.main("check"), folder.main("check")
    assert (first.status, again.status, "cached" in again.out) == (1, 1, True)
    assert "MuJoCo warned of bad accelerations of model `cart` at t = 0.0000 s" in first.out
    assert "diverged examples/a.py" in first.out
    assert first.out.split("\n\n")[0] == again.out.split("\n\n")[0]
    report = json.loads(folder.main("check", "--format", "json").out)
    assert [script["status"] for script in report["scripts"]] == ["diverged"]
    assert '<failure type="diverged"' in folder.main("check", "--format", "junit").out
    assert folder.main("build").status == 1
    assert not (folder.root / "public").exists()
    assert not list(folder.root.rglob("MUJOCO_LOG*"))
    folder.write(folder.lesson(), lesson("1e15", output="error 1.0"))
    done = folder.main("update")
    assert (done.status, "error[script-diverged]" in done.out) == (1, True)
    for text, expected in (
        (lesson("1e15"), ["script-diverged"]),
        (lesson("1e15", "diverges"), []),  # as it is remembered
        (lesson("0.0", "diverges"), ["script-stable"]),
        (lesson("0.0"), []),
    ):
        folder.write(folder.lesson(), text)
        assert rules() == expected
