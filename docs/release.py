"""What a release is made of besides the packages: one version, and the manuals of all releases.

Entry points, as commands: `python docs/release.py WORD …`.

- `owner https://github.com/NAME/coursebuild https://NAME.github.io/coursebuild/`: writes these
  addresses, of the repository and of its site, wherever they are named.
- `version 0.2.0`: writes a new version wherever it stands, and its heading into CHANGELOG.md.
- `check [TAG]`: fails if files differ in the version, or if a tag of this commit is another one.
- `maps FOLDER`: completes the maps in a copy of the sources with what only the publisher knows: the
  addresses of `coursebuild/__init__.py`, and the manual's version.
- `manuals SITE ARCHIVES RELEASE`: packs the manual in `SITE/docs/` into RELEASE, unpacks those of
  other releases from ARCHIVES, and puts them beside each other: the newest in `SITE/docs/`, each in
  a folder with the name of its version, each with the list of all (`versions.json`).
- `notes RELEASE`: writes what CHANGELOG.md says of the version.
"""

from __future__ import annotations

import gzip
import hashlib
import io
import json
import re
import shutil
import subprocess
import sys
import tarfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from coursebuild import MANUAL, REPOSITORY, SITE, __version__  # noqa: E402

PLACES = {
    "coursebuild/__init__.py": ['__version__ = "{}"\n'],
    "pyproject.toml": ['\nversion = "{}"\n'],
    "mjbench/pyproject.toml": ['\nversion = "{}"\n'],
    "plugins/cluster/pyproject.toml": ['\nversion = "{}"\n'],
    "plugins/mermaid/pyproject.toml": ['\nversion = "{}"\n'],
    "plugins/tabs/pyproject.toml": ['\nversion = "{}"\n'],
    "CITATION.cff": ["\nversion: {}\n"],
    "editors/vscode/package.json": ['\n  "version": "{}",\n'],
    "editors/vscode/package-lock.json": [
        '\n  "version": "{}",\n',
        '"coursebuild",\n      "version": "{}",\n',
    ],
    "docs/how-to/continuous-integration.md": [
        "/coursebuild@v{}\n",
        "    version: {}\n",
        "    rev: v{}\n",
    ],
}
"""Where the version stands, and in which words."""
NAME = re.compile(r"manual-([0-9][0-9A-Za-z.+-]*)\.tar\.gz")


def set_version(version: str) -> None:
    """Write a new version."""
    check_places()
    for path, lines in PLACES.items():
        text = (ROOT / path).read_text(encoding="utf-8")
        for line in lines:
            text = text.replace(line.format(__version__), line.format(version))
        (ROOT / path).write_text(text, encoding="utf-8")
    changes = ROOT / "CHANGELOG.md"
    text = changes.read_text(encoding="utf-8")
    heading = f"## Unreleased\n\n## {version}\n"
    changes.write_text(text.replace("## Unreleased\n", heading, 1), encoding="utf-8")


def set_owner(repository: str, site: str) -> None:
    """Write the addresses of the repository, on GitHub, and of its site, which ends in a slash."""
    name = repository.removeprefix("https://github.com/")
    if not re.fullmatch(r"[\w.-]+/coursebuild", name) or not re.fullmatch(r"https://\S+/", site):
        raise SystemExit("as `owner https://github.com/NAME/coursebuild https://SITE/`, please")
    links = f"**[Open the course]({site})**, made with coursebuild, or [the manual]({site}docs/)."
    for path, old, new in (
        ("coursebuild/__init__.py", 'REPOSITORY = ""\n', f'REPOSITORY = "{repository}"\n'),
        ("coursebuild/__init__.py", 'SITE = ""\n', f'SITE = "{site}"\n'),
        ("README.md", "<!-- links to the site -->\n", f"{links}\n"),
        (
            "CITATION.cff",
            "\nauthors:\n",
            f"\nrepository-code: {repository}\nurl: {site}\nauthors:\n",
        ),
        ("docs/how-to/continuous-integration.md", "OWNER/coursebuild", name),
        (
            "docs/how-to/continuous-integration.md",
            "`OWNER` is\nwhoever owns the repository; t",
            "T",
        ),
        ("docs/explanation/dependencies.md", "OWNER/coursebuild", name),
    ):
        text = (ROOT / path).read_text(encoding="utf-8")
        if old not in text:
            raise SystemExit(f"{path} has an owner already")
        (ROOT / path).write_text(text.replace(old, new), encoding="utf-8")


def check_places() -> None:
    """Fail unless all files say the same version."""
    for path, lines in PLACES.items():
        text = (ROOT / path).read_text(encoding="utf-8")
        if any(line.format(__version__) not in text for line in lines):
            raise SystemExit(f"{path} does not have the version {__version__} of the package")


def check(tag: str = "") -> None:
    """Fail unless all files and tags say the same version."""
    check_places()
    words = ["git", "tag", "--points-at", "HEAD", "v*"]
    tags = subprocess.run(
        words, cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout.split()
    for name in [tag] if tag else tags:
        if name != f"v{__version__}":
            raise SystemExit(
                f"the tag {name} is not v{__version__}, the version of the package: "
                f"`make version VERSION={name.removeprefix('v')}`, commit, and tag that"
            )


def complete_maps(sources: Path) -> None:
    """Write into the maps of a copy of the sources what is known of the site."""
    for name, address, version in (("content", SITE, ""), ("docs/content", MANUAL, __version__)):
        fields = {"base_url": address, "repository": REPOSITORY, "version": version}
        lines = "".join(f'{key} = "{value}"\n' for key, value in fields.items() if value)
        course_map = sources / name / "course.toml"
        text = course_map.read_text(encoding="utf-8")
        course_map.write_text(text.replace("[course]\n", f"[course]\n{lines}", 1), encoding="utf-8")


def arrange_manuals(site: Path, archives: Path, release: Path) -> None:
    """Put the manuals of all releases below `site/docs/`, that of this one packed into a folder."""
    from packaging.version import Version  # not there before packages are installed

    docs, manuals = site / "docs", site / ".manuals"
    (entry,) = json.loads((docs / "versions.json").read_text(encoding="utf-8"))
    docs.rename(manuals)
    docs.mkdir()
    release.mkdir(parents=True, exist_ok=True)
    pack(manuals, release / f"manual-{entry['version']}.tar.gz")
    shutil.move(manuals, docs / entry["version"])
    for archive in sorted(archives.glob("manual-*.tar.gz")):
        name = NAME.fullmatch(archive.name)
        if name is None:
            raise SystemExit(f"{archive.name} is not named as the manual of a release")
        if name[1] != entry["version"]:
            with tarfile.open(archive) as tar:
                tar.extractall(docs / name[1], filter="data")
    versions = sorted((path.name for path in docs.iterdir()), key=Version, reverse=True)
    pages_of = {version: pages(docs / version) for version in versions}
    shutil.copytree(docs / versions[0], docs, dirs_exist_ok=True)
    for version in (None, *versions):
        folder, up = (docs / version, "../") if version else (docs, "./")
        entries = [
            {
                "version": name,
                "root": up if name == versions[0] else f"{up}{name}/",
                "pages": pages_of[name],
            }
            for name in versions
        ]
        write_list(folder, f"{json.dumps(entries)}\n".encode())
    print(f"manuals of {', '.join(versions)} in {docs}")


def pages(manual: Path) -> list[str]:
    """The pages of a manual, by path."""
    return sorted(path.relative_to(manual).as_posix() for path in manual.rglob("*.html"))


def write_list(manual: Path, data: bytes) -> None:
    """Write `versions.json`, whose hash is in the list of files that readers keep offline."""
    place, files = manual / "versions.json", manual / "files.json"
    before, after = (hashlib.sha256(x).hexdigest()[:12] for x in (place.read_bytes(), data))
    place.write_bytes(data)
    files.write_text(files.read_text("utf-8").replace(before, after), encoding="utf-8")


def pack(folder: Path, archive: Path) -> None:
    """Pack a folder: the same files give the same bytes."""
    with (
        archive.open("wb") as raw,
        gzip.GzipFile("", "wb", fileobj=raw, mtime=0) as stream,
        tarfile.open(fileobj=stream, mode="w") as tar,
    ):
        for path in sorted(path for path in folder.rglob("*") if path.is_file()):
            entry, data = tarfile.TarInfo(path.relative_to(folder).as_posix()), path.read_bytes()
            entry.size = len(data)
            tar.addfile(entry, io.BytesIO(data))


def write_notes(release: Path) -> None:
    """Write what CHANGELOG.md says of this version, or has not been released yet."""
    parts = re.split(r"^## (.+)\n", (ROOT / "CHANGELOG.md").read_text("utf-8"), flags=re.MULTILINE)
    text_by_version = dict(zip(parts[1::2], parts[2::2], strict=True))
    text = text_by_version.get(__version__, text_by_version.get("Unreleased", ""))
    (release / "notes.md").write_text(f"{text.strip()}\n", encoding="utf-8")


def main(word: str, *arguments: str) -> None:
    """Do what the first word says."""
    match word:
        case "owner":
            set_owner(*arguments)
        case "version":
            set_version(*arguments)
        case "check":
            check(*arguments)
        case "maps":
            complete_maps(*map(Path, arguments))
        case "manuals":
            arrange_manuals(*map(Path, arguments))
        case "notes":
            write_notes(*map(Path, arguments))
        case _:
            raise SystemExit(__doc__)


if __name__ == "__main__":
    main(*sys.argv[1:])
