"""What `docs/release.py` refuses, and how it puts the manuals of releases beside each other."""

from __future__ import annotations

import hashlib
import json
import shutil
import subprocess
import sys
import tarfile
from pathlib import Path

import pytest

from coursebuild import __version__
from support.workflows import commit, git

ROOT = Path(__file__).resolve().parents[2]
PLACES = (
    "coursebuild/__init__.py",
    "pyproject.toml",
    "mjbench/pyproject.toml",
    "plugins/cluster/pyproject.toml",
    "plugins/mermaid/pyproject.toml",
    "plugins/tabs/pyproject.toml",
    "CITATION.cff",
    "editors/vscode/package.json",
    "editors/vscode/package-lock.json",
    "docs/how-to/continuous-integration.md",
)
OWNER_PLACES = ("README.md", "docs/explanation/dependencies.md")


@pytest.fixture
def repository(tmp_path: Path) -> Path:
    for path in (*PLACES, *OWNER_PLACES, "docs/release.py", "CHANGELOG.md"):
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / path, tmp_path / path)
    git(tmp_path, "init", "-q")
    commit(tmp_path)
    return tmp_path


def release(root: Path, *arguments: object) -> str:
    words = [sys.executable, "-B", root / "docs/release.py", *arguments]
    result = subprocess.run(words, cwd=root, capture_output=True, text=True)
    assert bool(result.returncode) == bool(result.stderr), result.stderr
    return result.stderr


def test_a_tag_that_is_not_the_version_is_refused(repository: Path) -> None:
    git(repository, "tag", f"v{__version__}")
    assert release(repository, "check") == ""
    assert release(repository, "check", f"v{__version__}") == ""
    refusal = (
        f"the tag v9.0.0 is not v{__version__}, the version of the package: "
        "`make version VERSION=9.0.0`, commit, and tag that\n"
    )
    assert release(repository, "check", "v9.0.0") == refusal
    git(repository, "tag", "v9.0.0")
    assert release(repository, "check") == refusal


def test_a_new_version_is_written_everywhere(repository: Path) -> None:
    assert release(repository, "version", "9.0.0") == ""
    changed = git(repository, "diff", "--name-only").splitlines()
    assert sorted(changed) == sorted((*PLACES, "CHANGELOG.md"))
    assert "## Unreleased\n\n## 9.0.0\n" in (repository / "CHANGELOG.md").read_text("utf-8")
    commit(repository)
    git(repository, "tag", "v9.0.0")
    assert release(repository, "check") == ""


def test_the_owner_is_written_wherever_there_was_none(repository: Path) -> None:
    address, site = "https://github.com/apple/coursebuild", "https://apple.github.io/coursebuild/"
    call = "as `owner https://github.com/NAME/coursebuild https://SITE/`, please\n"
    assert release(repository, "owner", "apple/tree", site) == call
    assert release(repository, "owner", address, site.removesuffix("/")) == call
    assert release(repository, "owner", address, site) == ""
    assert not [path for path in repository.rglob("*.md") if "OWNER" in path.read_text("utf-8")]
    assert f"**[Open the course]({site})**" in (repository / "README.md").read_text("utf-8")
    tool = (repository / "coursebuild/__init__.py").read_text("utf-8")
    assert f'\nREPOSITORY = "{address}"\n' in tool and f'\nSITE = "{site}"\n' in tool
    assert release(repository, "version", "9.0.0") == ""
    assert release(repository, "owner", address, site) == (
        "coursebuild/__init__.py has an owner already\n"
    )


def test_files_with_another_version_are_named(repository: Path) -> None:
    for path in PLACES[1:]:
        text = (repository / path).read_text("utf-8")
        (repository / path).write_text(text.replace(__version__, "9.0.0"), encoding="utf-8")
        message = f"{path} does not have the version {__version__} of the package\n"
        assert release(repository, "check") == message
        (repository / path).write_text(text, encoding="utf-8")


def test_notes_are_of_the_version_or_of_what_is_not_released(repository: Path) -> None:
    changes = repository / "CHANGELOG.md"
    changes.write_text("# Changes\n\n## Unreleased\n\n- new\n\n## 0.0.1\n\n- old\n")
    release(repository, "notes", repository)
    assert (repository / "notes.md").read_text() == "- new\n"
    changes.write_text(
        f"# Changes\n\n## Unreleased\n\n## {__version__}\n\n- this\n\n## 0.0.1\n\n-\n"
    )
    release(repository, "notes", repository)
    assert (repository / "notes.md").read_text() == "- this\n"


# ------------------------------------------------------------------------------------- manuals


def manual(folder: Path, version: str, *pages: str) -> Path:
    """Files that a manual of a version has, as the tool writes them."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for page in ("index.html", *pages):
        (folder / page).write_text(f"{page} of {version}")
    entry = f'[{{"version": "{version}", "root": "./"}}]\n'
    (folder / "versions.json").write_text(entry)
    digest = hashlib.sha256(entry.encode()).hexdigest()[:12]
    (folder / "files.json").write_text(json.dumps({"versions.json": digest}))
    return folder


def test_the_newest_manual_is_in_docs_and_each_in_its_folder(tmp_path: Path) -> None:
    """Released in this order: 0.9.0, 0.10.0, and a correction of the first, which is no newest."""
    files, docs = tmp_path / "files", tmp_path / "site/docs"
    for version, page in (("0.9.0", "old.html"), ("0.10.0", "new.html"), ("0.9.1", "old.html")):
        shutil.rmtree(tmp_path / "site", ignore_errors=True)
        manual(docs, version, page)
        assert release(ROOT, "manuals", tmp_path / "site", files, files) == ""
    assert (docs / "index.html").read_text() == "index.html of 0.10.0"
    assert not (docs / "old.html").exists()
    assert sorted(path.name for path in docs.iterdir() if path.is_dir()) == [
        "0.10.0",
        "0.9.0",
        "0.9.1",
    ]
    assert (docs / "0.9.0/old.html").read_text() == "old.html of 0.9.0"
    for folder, roots in (
        (docs, ["./", "./0.9.1/", "./0.9.0/"]),
        (docs / "0.10.0", ["../", "../0.9.1/", "../0.9.0/"]),
        (docs / "0.9.0", ["../", "../0.9.1/", "../0.9.0/"]),
    ):
        data = (folder / "versions.json").read_bytes()
        entries = json.loads(data)
        assert [entry["version"] for entry in entries] == ["0.10.0", "0.9.1", "0.9.0"]
        assert [entry["root"] for entry in entries] == roots
        assert [entry["pages"][-1] for entry in entries] == ["new.html", "old.html", "old.html"]
        digest = json.loads((folder / "files.json").read_text())["versions.json"]
        assert digest == hashlib.sha256(data).hexdigest()[:12], "kept offline"


def test_the_same_manual_is_packed_into_the_same_bytes(tmp_path: Path) -> None:
    archives = []
    for run in ("a", "b"):
        manual(tmp_path / run / "site/docs", "1.0.0", "rules.html")
        release(ROOT, "manuals", tmp_path / run / "site", tmp_path / "none", tmp_path / run)
        archives.append((tmp_path / run / "manual-1.0.0.tar.gz").read_bytes())
    assert archives[0] == archives[1]


def test_an_archive_writes_nothing_outside_its_folder(tmp_path: Path) -> None:
    manual(tmp_path / "site/docs", "1.0.0")
    (tmp_path / "files").mkdir()
    with tarfile.open(tmp_path / "files/manual-0.9.0.tar.gz", "w:gz") as tar:
        tar.add(tmp_path / "site/docs/index.html", "../../stray.html")
    assert "OutsideDestinationError" in release(
        ROOT, "manuals", tmp_path / "site", tmp_path / "files", tmp_path / "release"
    )
    assert not list(tmp_path.rglob("stray.html"))
