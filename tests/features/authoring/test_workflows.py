"""The workflows of a new course: GitHub accepts them, and each step does what the docs say."""

from __future__ import annotations

import json
import re
import shlex
import zipfile
from importlib.resources import files
from pathlib import Path
from typing import Any

import pytest
import yaml
from jsonschema import Draft7Validator

from coursebuild import __version__
from coursebuild.cli.commands import known_commands, parser_of
from coursebuild.core.run.script_environment import engine_version
from support.markdown_files import DOCS, ROOT, fences
from support.sandboxes import require_sandbox
from support.scratch_course import FIRST, SECOND, Folder
from support.workflows import Runner, Step, commit, git

PAGES = ("continuous-integration", "publish")
FENCES = [fence for page in PAGES for fence in fences(DOCS / f"how-to/{page}.md")]
COURSE = ".github/workflows/course.yml"
WEEKLY = ".github/workflows/weekly.yml"
TEMPLATES = ROOT / "coursebuild/features/authoring/course"
WRITTEN = {path: (TEMPLATES / Path(path).name).read_text() for path in (COURSE, WEEKLY)}
PINNED_ACTION = re.compile(
    r"[\w-]+/[\w/-]+@[0-9a-f]{40} # v\d+\.\d+\.\d+\b.*|\./|[\w-]+/coursebuild@v"
    + re.escape(__version__)
)
INSTALLATION = re.compile(
    r"pip (install (--require-hashes|--no-deps( --no-build-isolation)?) .*|check"
    r'|install -r (requirements.txt|"\$RUNNER_TEMP/course.txt"))'
)
SUDO = (
    "sudo apt-get install --quiet --yes bubblewrap",
    "sudo sysctl kernel.apparmor_restrict_unprivileged_userns=0",
)
HOOKS = yaml.safe_load((ROOT / ".pre-commit-hooks.yaml").read_text())
ACTION = yaml.safe_load((ROOT / "action.yml").read_text())


def workflow(path: str = COURSE) -> dict[str, Any]:
    data: dict[str, Any] = yaml.safe_load(WRITTEN[path])
    return data


def publishing_elsewhere() -> list[dict[str, Any]]:
    """The workflow with each of the documented jobs that can replace its last one."""
    jobs = [yaml.safe_load(fence.text) for fence in FENCES if fence.is_("publish")]
    return [{**workflow(), "jobs": workflow()["jobs"] | job} for job in jobs]


def all_workflows() -> list[dict[str, Any]]:
    project_workflow = yaml.safe_load((ROOT / COURSE).read_text())
    return [project_workflow, workflow(), workflow(WEEKLY), *publishing_elsewhere()]


def jobs() -> list[dict[str, Any]]:
    return [job for data in all_workflows() for job in data["jobs"].values()]


def commands(steps: list[dict[str, Any]]) -> list[str]:
    return [step["run"] for step in steps if "run" in step]


# ------------------------------------------------------------------------------------- as text


@pytest.mark.site
def test_a_new_course_has_the_workflows(tmp_path: Path) -> None:
    folder = Folder(tmp_path)
    assert folder.main("init").status == 0
    assert {path: folder.text(path) for path in WRITTEN} == WRITTEN


def test_github_takes_the_workflows_and_the_action() -> None:
    schemas = files("check_jsonschema") / "builtin_schemas" / "vendor"
    texts = {
        name: (schemas / f"github-{name}.json").read_text() for name in ("workflows", "actions")
    }
    check = {name: Draft7Validator(json.loads(text)) for name, text in texts.items()}
    release = yaml.safe_load((ROOT / ".github/workflows/release.yml").read_text())
    for data in (*all_workflows(), release):
        keyed = {("on" if key is True else key): value for key, value in data.items()}  # YAML 1.1
        check["workflows"].validate(keyed)
    check["actions"].validate(ACTION)


def test_course_code_runs_with_no_secret_and_no_right_to_write() -> None:
    """But for the key of what main itself has kept, which only main's own build gets."""
    key = "${{ secrets.COURSEBUILD_STORE_KEY }}"
    for data in all_workflows():
        assert data["permissions"] == {"contents": "read"}
        assert "pull_request_target" not in str(data)
    for job in jobs():
        has_key = key in str(job)
        assert not has_key or job == workflow()["jobs"]["build"]
        trusted = (
            "secrets." in str(job).replace(key, "")
            or "write" in job.get("permissions", {}).values()
        )
        runs_the_course = "coursebuild" in str(job["steps"]) or "checkout" in str(job["steps"])
        assert not (trusted and runs_the_course)
        if trusted:
            assert job["needs"] == "build"
    assert workflow()["jobs"]["build"]["if"] == "github.event_name == 'push'"
    assert workflow()[True]["push"] == {"branches": ["main"]}


def test_actions_are_pinned_and_no_expression_becomes_code() -> None:
    (example,) = (yaml.safe_load(fence.text) for fence in FENCES if fence.is_("action"))
    steps = [step for job in jobs() for step in job["steps"]] + example + ACTION["runs"]["steps"]
    texts = [path.read_text() for path in (ROOT / ".github/workflows").iterdir()]
    texts += [
        *(fence.text for fence in FENCES),
        *WRITTEN.values(),
        (ROOT / "action.yml").read_text(),
    ]
    actions = [name for text in texts for name in re.findall(r"uses: *(.*)", text)]
    assert len(actions) > 20
    assert [name for name in actions if not PINNED_ACTION.fullmatch(name)] == []
    hashes = dict(re.findall(r"([\w/-]+)@([0-9a-f]{40} # v\d+)", "\n".join(actions)))
    assert hashes["actions/cache"] == hashes["actions/cache/restore"]
    assert [line for line in commands(steps) if "${{" in line] == []
    for step in steps:
        if step.get("uses", "").startswith("actions/checkout@"):
            assert step["with"]["persist-credentials"] is False
    assert example[0]["with"].keys() == ACTION["inputs"].keys()


def test_packages_are_installed_by_their_hashes() -> None:
    """All but the tool itself, whose hash nobody knows before its release."""
    steps = [step for job in jobs() for step in job["steps"]] + ACTION["runs"]["steps"]
    lines = [line.strip() for text in commands(steps) for line in text.splitlines()]
    installations = [line for line in lines if re.search(r"\bpip\b", line)]
    assert len(installations) >= 8
    assert [line for line in installations if not INSTALLATION.fullmatch(line)] == []


def test_pull_request_leaves_no_cache_and_runs_scripts_in_the_sandbox_only() -> None:
    job = workflow()["jobs"]["check"]
    actions = [step["uses"].partition("@")[0] for step in job["steps"] if "uses" in step]
    assert actions == ["actions/checkout", "actions/setup-python", "actions/cache/restore"]
    assert "cache" not in str([step.get("with") for step in job["steps"][:2]])
    called = [line for line in commands(job["steps"]) if line.startswith("coursebuild ")]
    assert [line.split()[1:3] for line in called] == [
        ["doctor", "--install-engine"],
        ["check", "--sandbox"],
        ["build", "--sandbox"],
        ["diff", "HEAD^"],
    ]
    assert "--sandbox" in called[-1]
    keys = {"runs-on", "timeout-minutes", "steps", "if"}
    assert job.keys() == keys, "no environment, permission or secret of its own"


def test_every_command_line_is_accepted() -> None:
    lines = [line for job in jobs() for line in commands(job["steps"])]
    lines += [line for fence in FENCES if fence.kind == "sh" for line in fence.text.splitlines()]
    lines += [
        *(hook["entry"] for hook in HOOKS),
        "coursebuild " + ACTION["inputs"]["command"]["default"],
    ]
    called = [re.split("[>|]", line)[0] for line in lines if line.startswith("coursebuild ")]
    assert len(called) >= 10
    for line in called:
        name, *rest = shlex.split(line)[1:]
        parser_of(known_commands()[name]).parse_args(rest)


# --------------------------------------------------------------------------- run, step by step

LOCKS = {
    "requirements.lock": "numpy==2.3.0 --hash=sha256:00\n",
    ".github/coursebuild.txt": f"coursebuild=={__version__}\n",
    "requirements.txt": "pandas==2.3.3\n",
}
INSTALLED = ("requirements.lock", "coursebuild.txt", "course.txt")
"""What a pull request finds them as."""


@pytest.fixture
def course(tmp_path: Path, stores: Path) -> Folder:
    """A repository with a course of two lessons."""
    folder = Folder(tmp_path / "repository")
    folder.fill([FIRST, SECOND], stores)
    folder.write(".gitignore", ".coursebuild/\nexamples/\npublic/\n")
    for path, text in LOCKS.items():
        folder.write(path, text)
    git(folder.root, "init", "-q", "-b", "main")
    commit(folder.root)
    return folder


@pytest.fixture
def runner(course: Folder, tmp_path: Path) -> Runner:
    secrets = (
        "COURSEBUILD_STORE_KEY",
        "NETLIFY_AUTH_TOKEN",
        "NETLIFY_SITE_ID",
        "SSH_KEY",
        "SSH_KNOWN_HOSTS",
        "SSH_TARGET",
    )
    return Runner(tmp_path / "service", course.root, {name: f"<{name}>" for name in secrets})


def push(runner: Runner, data: dict[str, Any] | None = None) -> dict[str, list[Step]]:
    return runner.run(data or workflow(), "main", event_name="push")


def propose(runner: Runner, course: Folder, lesson: str) -> list[Step]:
    """A pull request that changes the second lesson; gives the commands of its only job."""
    base = git(course.root, "rev-parse", "main")
    git(course.root, "checkout", "-q", "-B", "change", "main")
    course.write(course.lesson(2), lesson)
    for path in LOCKS:
        course.write(path, "./tool\n")  # a tool of its own
    commit(course.root)
    git(course.root, "checkout", "-q", "-B", "merged", "main")
    git(course.root, "merge", "-q", "--no-ff", "-m", "merged", "change")
    event = {"event_name": "pull_request", "event.pull_request.base.sha": base}
    steps_by_job = runner.run(workflow(), "merged", **event)
    assert [*steps_by_job] == ["check"]
    return steps_by_job["check"]


def installations(lock: str, tool: str, course: str) -> list[str]:
    """The calls of pip that install what these files name."""
    return [
        f"pip install --require-hashes -r {lock}",
        f"pip install --no-deps -r {tool}",
        f"pip install -r {course}",
    ]


def statuses(steps: list[Step]) -> list[int]:
    return [step.status for step in steps]


@pytest.mark.site
def test_only_main_is_published_and_a_pull_request_gets_a_report(
    course: Folder, runner: Runner
) -> None:
    require_sandbox(course.root)
    steps_by_job = push(runner)
    assert {name: statuses(steps) for name, steps in steps_by_job.items()} == {
        "build": [0, 0],
        "publish": [],
    }
    page = runner.folder / "pages/lessons/1.2-two.html"
    assert ">2</" in page.read_text()
    caches = [*runner.caches]
    assert caches == [f"course-{git(course.root, 'rev-parse', 'main')}"]

    steps_with_mistake = propose(runner, course, SECOND.replace("```text\n2", "```text\n3"))
    assert statuses(steps_with_mistake) == [0, 0, 0, 1, 0], "without a build, and with a report"
    assert "running scripts (2)\n" in steps_with_mistake[3].err, "what main keeps has its secret"
    for name, text in zip(INSTALLED, LOCKS.values(), strict=True):
        assert (runner.folder / "tmp" / name).read_text() == text
    assert steps_with_mistake[3].out.startswith(f"::error file={course.lesson(2)},line=10,col=1,")
    assert "| `examples/two.py` | 1.2 | numeric: 1 (relative, up to 5.0e-01) |" in runner.summary
    assert "-2\n+3\n" in runner.summary
    assert runner.summary.endswith("Not compared: there is no site in `preview`.\n")

    steps_without_mistake = propose(
        runner, course, SECOND.replace("print(2)", "print(12)").replace("\n2\n", "\n12\n")
    )
    assert statuses(steps_without_mistake) == [0] * 6, steps_without_mistake
    assert "\n| the whole site | " in runner.summary
    assert [*runner.caches] == caches
    assert ">12</" not in page.read_text()
    installed = installations("requirements.lock", ".github/coursebuild.txt", "requirements.txt")
    paths = [f"{runner.folder}/tmp/{name}" for name in INSTALLED]
    check = [*installations(*paths), *SUDO]
    assert runner.notes == [*installed, *check, *check]


@pytest.mark.long
def test_new_course_with_its_lab_passes_its_jobs(tmp_path: Path) -> None:
    folder = Folder(tmp_path / "repository")
    folder.root.mkdir()
    require_sandbox(folder.root)
    assert folder.main("init").status == 0
    commit(folder.root)
    runner = Runner(tmp_path / "service", folder.root, {"COURSEBUILD_STORE_KEY": "a key"})
    assert statuses(push(runner)["build"]) == [0, 0]
    git(folder.root, "checkout", "-q", "-b", "change")
    path = "content/lessons/1.1-pendulum.md"
    folder.write(path, folder.text(path).replace('"Push"', '"Kick"'))
    commit(folder.root)
    base = git(folder.root, "rev-parse", "main")
    event = {"event_name": "pull_request", "event.pull_request.base.sha": base}
    steps = runner.run(workflow(), "change", **event)["check"]
    assert statuses(steps) == [0] * 6, steps
    assert "`controls`" in runner.summary


@pytest.mark.site
def test_publishing_elsewhere_sends_what_main_built(runner: Runner) -> None:
    netlify, rsync = publishing_elsewhere()
    for data in (netlify, rsync):
        steps_by_job = push(runner, data)
        assert statuses(steps_by_job["publish"]) == [0, 0], steps_by_job["publish"]
        page = runner.folder / "sent/lessons/1.2-two.html"
        assert ">2</" in page.read_text()
        page.unlink()
    key = runner.folder / "home/.ssh/id_ed25519"
    assert (key.read_text(), key.stat().st_mode & 0o777) == ("<SSH_KEY>\n", 0o600)
    first, second = [note for note in runner.notes if not note.startswith("pip ")]
    assert first.endswith(" deploy --prod --no-build --dir public")
    assert second == "rsync -rt --delete-after --delay-updates public/ <SSH_TARGET>"


@pytest.mark.site
def test_weekly_everything_is_run_anew_and_with_the_newest_engine(
    course: Folder, runner: Runner, tmp_path: Path
) -> None:
    engine = engine_version()
    name = f"mujoco-{engine}"
    with zipfile.ZipFile(tmp_path / f"{name}-py3-none-any.whl", "w") as wheel:
        metadata = f"Metadata-Version: 2.1\nName: mujoco\nVersion: {engine}\n"
        wheel.writestr(f"{name}.dist-info/METADATA", metadata)
        wheel.writestr(f"{name}.dist-info/WHEEL", "Wheel-Version: 1.0\nTag: py3-none-any\n")
    runner.environment |= {"PIP_NO_INDEX": "1", "PIP_FIND_LINKS": str(tmp_path)}
    steps_by_job = runner.run(workflow(WEEKLY), "main")
    assert {name: statuses(steps) for name, steps in steps_by_job.items()} == {
        "anew": [0, 0],
        "newest-engine": [0, 0, 0],
    }, steps_by_job
    assert runner.summary.startswith(f"```text\nMuJoCo {engine} against {engine}, ")
    assert runner.summary.endswith("\n```\n")


@pytest.mark.site
def test_action_installs_a_version_and_runs_a_command(course: Folder, runner: Runner) -> None:
    defaults = {name: value["default"] for name, value in ACTION["inputs"].items()}
    parent, steps = course.root.parent, ACTION["runs"]["steps"]
    results = runner.action(parent, steps, **{**defaults, "path": course.root.name})
    assert statuses(results) == [0, 0], results
    file = runner.folder / "tmp/coursebuild.txt"
    inputs = {"version": "0.9.0", "path": course.root.name, "command": "build --out ../site"}
    refused = runner.action(parent, steps[:2], **inputs, hash="")
    assert [step.status != 0 for step in refused] == [True]
    assert refused[0].err.endswith("version needs a hash\n")
    assert statuses(runner.action(parent, steps, **inputs, hash="sha256:00")) == [0, 0]
    packages = (file.parent / "packages.txt").read_text()
    assert {"hatchling", "matplotlib", "msgspec"} <= {*re.findall(r"(?m)^([\w-]+)==", packages)}
    assert file.read_text() == "coursebuild==0.9.0 --hash=sha256:00\n"
    assert (parent / "site/index.html").is_file()
    locked = f"pip install --require-hashes -r {runner.folder}/tmp/packages.txt"
    assert runner.notes == [
        *(locked, "pip install --no-deps --no-build-isolation .", "pip check"),
        locked,
        *(locked, f"pip install --require-hashes --no-deps -r {file}", "pip check"),
    ]


@pytest.mark.site
def test_hooks_stop_a_commit_with_a_mistake(course: Folder, runner: Runner) -> None:
    (config,) = (yaml.safe_load(fence.text) for fence in FENCES if fence.is_("pre-commit"))
    assert config["repos"][0]["hooks"] == [{"id": hook["id"]} for hook in HOOKS]
    assert all(re.search(hook["files"], course.lesson()) for hook in HOOKS)
    steps = [{"run": hook["entry"]} for hook in HOOKS]
    assert statuses(runner.action(course.root, steps)) == [0, 0]
    lesson = SECOND.replace("```text\n2", "```text\n3")
    course.write(course.lesson(2), lesson + "\n\n\n")
    results = runner.action(course.root, steps)
    assert (statuses(results), course.text(course.lesson(2))) == ([0, 1], lesson.rstrip() + "\n")
    assert results[1].out.startswith("error[output-drift]")
