"""What readers are handed over of a script."""

from __future__ import annotations

from typing import Literal, TypeAlias

from msgspec import Struct

DownloadState: TypeAlias = Literal["unrun", "ran", "failed"]


class ScriptDownload(Struct, frozen=True):
    """What readers are handed over of a script: a file that runs by itself, or an archive."""

    script: str
    """The script's path."""
    files: tuple[tuple[str, bytes], ...]
    """The one file, or those of the archive, by their paths in the folder where they are to lie."""
    entry: str
    """The path of the file to run."""
    packages: tuple[str, ...]
    """What it needs, as installers take it: `mujoco==3.14.0`."""
    modules: tuple[str, ...]
    """The top-level modules that it imports of others."""
    unknown_modules: tuple[str, ...] = ()
    """Those of them whose package is not known here."""
    archive: bool = False
    state: DownloadState = "unrun"
    """Whether it was run in an empty folder, and how that ended."""

    @property
    def path(self) -> str:
        """Its path in the site."""
        return f"{self.script.removesuffix('.py')}.zip" if self.archive else self.script
