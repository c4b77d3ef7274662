"""Texts from packages of npm and PyPI, got by the registries' own clients; nothing of them is run.

Entry point: `texts_of`. `npm pack` only fetches an archive. `pip download` would build what it
fetches, and so run code of the package: here pip finds the archive, and fetches it in its own
session, as its user has configured it.
"""

from __future__ import annotations

import shutil
import tarfile
from collections.abc import Sequence
from fnmatch import fnmatchcase
from pathlib import Path, PurePosixPath
from urllib.parse import quote

from coursebuild.core.run import gate

SECONDS = 300.0
"""How long a registry may take for an archive."""
_PIP = """
import hashlib, sys
from pathlib import Path
from pip._internal.commands import create_command
from pip._internal.req.constructors import install_req_from_line

name, target = sys.argv[1:]
command = create_command("download")
options, _ = command.parse_args(["--no-deps", "--no-binary", ":all:", name])
wanted = install_req_from_line(name).req
with command.main_context():
    session = command.get_default_session(options)
    finder = command._build_package_finder(options, session)
    best = finder.find_best_candidate(wanted.name, wanted.specifier).best_candidate
    if best is None:
        sys.exit(f"there is no source distribution of {name}")
    link = best.link
    response = session.get(link.url_without_fragment, headers={"Accept-Encoding": "identity"})
    response.raise_for_status()
if link.hash_name and hashlib.new(link.hash_name, response.content).hexdigest() != link.hash:
    sys.exit(f"{link.filename} is not what the index says")
Path(target, link.filename).write_bytes(response.content)
"""


class PackageError(Exception):
    """A package cannot be had."""


def texts_of(packages: Sequence[str], patterns: Sequence[str], cache: Path, target: Path) -> None:
    """Unpack the files of packages that match, each package into a folder of its own.

    A package is a name such as `pypi:mesa==3.3.1` or `npm:npm@11.21.2`; a pattern is of paths
    below the first folder of its archive. `cache` holds archives that were fetched before.

    Raises:
        PackageError: a registry does not give it, or it has no such file.
    """
    for package in packages:
        archive = _fetch(package, cache)
        folder = target if len(packages) == 1 else target / archive.name.partition("-")[0]
        count = _unpack(archive, patterns, folder)
        if not count:
            raise PackageError(f"{package} has no file that matches")


def _fetch(package: str, cache: Path) -> Path:
    """The archive of a package."""
    folder = cache / quote(package, safe="@=")
    if not folder.is_dir():
        registry, _, name = package.partition(":")
        new = folder.with_name(f"{folder.name}.new")
        shutil.rmtree(new, ignore_errors=True)
        new.mkdir(parents=True)
        if registry == "npm":
            npm = gate.find_program("npm")
            if npm is None:
                raise PackageError("npm is not installed")
            command = [npm, "pack", name, "--ignore-scripts", f"--pack-destination={new}"]
        else:
            command = gate.python_command("-c", _PIP, name, str(new))
        names = (*gate.INSTALLERS, "NPM_CONFIG_*", "npm_config_*")
        run = gate.finish(command, gate.environment(*names), seconds=SECONDS)
        if run.status:
            raise PackageError(f"{package}: {run.last_line()}")
        new.rename(folder)
    return next(folder.iterdir())


def _unpack(archive: Path, patterns: Sequence[str], folder: Path) -> int:
    count = 0
    with tarfile.open(archive) as file:
        for member in file:
            path = PurePosixPath(*PurePosixPath(member.name).parts[1:]).as_posix()
            if member.isfile() and any(fnmatchcase(path, pattern) for pattern in patterns):
                file.extract(member.replace(name=path), folder, filter="data")
                count += 1
    return count
