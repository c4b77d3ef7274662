"""Build hook of the Python package: the browser's half and the templates go into the wheel.

Entry points: `BrowserHook` and `LinkHook`, which hatchling finds here. In a wheel, the files of
site/dist become coursebuild/assets/, templates/ becomes coursebuild/templates/, and
docs/reference/rules.md goes with them. A source distribution holds site/dist, so that a wheel can
be made of it without Node and npm. An editable install only gets an up-to-date site/dist, and
compiled modules: there the tool reads all this where it is. The work is done by site/bundle.py.
"""

import compileall
import contextlib
import sys
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface
from hatchling.metadata.plugin.interface import MetadataHookInterface

# A build environment doesn't have the project on its path.
sys.path.insert(0, str(Path(__file__).resolve().parent))
sys.path.insert(0, str(Path(__file__).resolve().parent / "site"))
import bundle

from coursebuild import MANUAL, REPOSITORY, SITE


class LinkHook(MetadataHookInterface):
    """Gives the package the links that are known."""

    PLUGIN_NAME = "custom"

    def update(self, metadata: dict[str, Any]) -> None:
        """Adds the links to the package's metadata."""
        links = {"Homepage": SITE or REPOSITORY, "Documentation": MANUAL}
        if REPOSITORY:
            links["Source"] = REPOSITORY
            links["Changelog"] = f"{REPOSITORY}/blob/main/CHANGELOG.md"
            links["Issues"] = f"{REPOSITORY}/issues"
        metadata["urls"] = {name: address for name, address in links.items() if address}


class BrowserHook(BuildHookInterface[Any]):
    """Bundles before the package is made, and keeps other builds waiting until it is."""

    PLUGIN_NAME = "custom"

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self._lock = contextlib.ExitStack()

    def dependencies(self) -> list[str]:
        """Returns what a build needs besides hatchling: nothing where site/dist is up to date."""
        return [] if bundle.is_fresh() else bundle.requirements()

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Bundles; for a wheel also names the files to take."""
        self._lock.enter_context(bundle.exclusive())
        try:
            bundle.bundle()
            files = _assets() | _templates(Path(self.root))
        except bundle.BundleError as error:
            self.app.abort(str(error))
        if version == "editable":
            _compile(Path(self.root))
        elif self.target_name == "wheel":
            texts = {
                "docs/reference/rules.md": "coursebuild/docs/rules.md",
                "requirements.lock": "coursebuild/locks/requirements.lock",
            }
            files |= {str(Path(self.root, path)): place for path, place in texts.items()}
            build_data["force_include"].update(files)
            build_data["sbom_files"].append(str(bundle.SBOM.relative_to(self.root)))

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """Lets the next build go on: the files have been read."""
        self._lock.close()


def _compile(root: Path) -> None:
    """Compiles the modules, as an installer does with those of a wheel.

    Where Python is told to write no bytecode (`PYTHONDONTWRITEBYTECODE`), a command would compile
    all that it imports each time: for a fifth of a second.
    """
    for folder in (root / "coursebuild", root / "mjcourse", bundle.DIST):
        compileall.compile_dir(folder, quiet=2)


def _assets() -> dict[str, str]:
    return {str(bundle.DIST / path): f"coursebuild/assets/{path}" for path in bundle.outputs()}


def _templates(root: Path) -> dict[str, str]:
    folder = root / "templates"
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    if not files:
        raise bundle.BundleError("templates/ holds no file: the package would be without its pages")
    return {
        str(path): f"coursebuild/templates/{path.relative_to(folder).as_posix()}"
        for path in files
        if not path.name.startswith(".")
    }
