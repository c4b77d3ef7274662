"""Where the files lie that come with the tool and are not Python.

Entry points: `assets_dir`, for what the build of the package bundles for browsers; `templates_dir`,
for the pages' templates; `bundled_files` and `template_texts` read them whole.

In an installed package both are inside it. In a source tree they are where they are made:
`site/dist` and `templates`.
"""

from __future__ import annotations

from pathlib import Path

from coursebuild.effects.errors import EffectError

_PACKAGE = Path(__file__).resolve().parents[1]
_TREE = _PACKAGE.parent


def assets_dir() -> Path:
    """The bundled scripts, styles and fonts.

    Raises:
        EffectError: this is a source tree where they have not been built.
    """
    return _first(_PACKAGE / "assets", _TREE / "site" / "dist", "the browser's files are not built")


def templates_dir() -> Path:
    """The templates of the pages.

    Raises:
        EffectError: the installation is broken.
    """
    return _first(_PACKAGE / "templates", _TREE / "templates", "the page templates are missing")


def bundled_files() -> tuple[tuple[str, bytes], ...]:
    """Every bundled file by path relative to `assets_dir()`, sorted."""
    folder = assets_dir()
    return tuple(
        (path.relative_to(folder).as_posix(), path.read_bytes())
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.name != "stamp.json"
    )


def template_texts() -> tuple[tuple[str, str], ...]:
    """Every template and table of strings by path relative to `templates_dir()`, sorted."""
    folder = templates_dir()
    return tuple(
        (path.relative_to(folder).as_posix(), path.read_text(encoding="utf-8"))
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.suffix in (".html", ".toml", ".svg")
    )


def _first(installed: Path, in_tree: Path, otherwise: str) -> Path:
    for folder in (installed, in_tree):
        if folder.is_dir():
            return folder
    raise EffectError(
        f"{otherwise}: there is no {installed}",
        help="in a source tree, run `make site`; otherwise install coursebuild again",
    )
