"""Find the model files of the course that a script belongs to.

Entry point: `model_path`. Steps: find the calling script, walk up from it to the course's root,
check the name, and return the file under `models/` or propose similar names.

A course root is the nearest folder above the script that holds `content/course.toml`. Above a
script of a downloaded course, which comes without `content/`, it is the nearest folder that holds
`models/` beside `examples/`.
"""

import difflib
import os
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path, PurePosixPath
from types import FrameType

_SUFFIX = ".xml"
_MOST_LISTED = 8
"""The most names that an error lists."""
_LIKENESS = 0.6
"""How similar a name must be, from 0 to 1, to be proposed."""


class ModelNotFoundError(FileNotFoundError):
    """No such model in the course of the calling script, or no course around that script."""


def model_path(name: str) -> Path:
    """Return the path of a model of the course that the calling script belongs to.

    The current folder plays no part, save at an interactive prompt, so a script finds its models
    from wherever it is started.

    Args:
        name: the file below `models/`, with or without `.xml`; a sub-folder is written with `/`, as
            in `"arms/ur5"`.

    Returns:
        The absolute path of an existing file.

    Raises:
        ModelNotFoundError: the course has no such model, or the script is in no course.
        ValueError: the name is empty, absolute, holds `..`, or leads out of `models/` through a
            link.
        TypeError: the name is not a string.
    """
    parts = _parts(name)
    starts = tuple(_starts(sys._getframe(1)))
    root = next(filter(None, map(_find_root, starts)), None)
    if root is None:
        places = " or ".join(map(str, starts)) or "the current folder, which is gone"
        raise ModelNotFoundError(
            f"no course for model {name!r}: no folder at or above {places} "
            "has content/course.toml, nor models/ beside examples/"
        )
    models = root / "models"
    path = models.joinpath(*parts)
    if not _is_file(path):
        raise ModelNotFoundError(
            _describe_missing(name, "/".join(parts).removesuffix(_SUFFIX), models)
        )
    if not path.resolve().is_relative_to(models.resolve()):
        raise ValueError(f"model {name!r} is a link that leads out of {models}")
    return path


def _parts(name: object) -> tuple[str, ...]:
    """The components of a model's file below `models/`."""
    if not isinstance(name, str):
        raise TypeError(f"the name of a model must be a string, got {type(name).__name__}")
    if "\\" in name or ":" in name or "\0" in name:
        raise ValueError(f"model name {name!r} holds a character that no portable file name has")
    if name.startswith("/"):
        raise ValueError(f"model name {name!r} is absolute; give it relative to models/")
    parts = tuple(name.split("/"))
    if ".." in parts:
        raise ValueError(f"model name {name!r} leads out of models/")
    if not all(part not in ("", ".") for part in parts) or parts[-1] == _SUFFIX:
        raise ValueError(f"model name {name!r} is not the name of a file below models/")
    return parts if name.endswith(_SUFFIX) else (*parts[:-1], parts[-1] + _SUFFIX)


def _starts(frame: FrameType | None) -> Iterator[Path]:
    """The files to look for a course from: the calling code, outwards to the script itself.

    Where there are none, the current folder.
    """
    visited: set[str] = set()
    main = False
    while frame is not None and not main:
        main = frame.f_globals.get("__name__") == "__main__"
        yield from _start_at(frame.f_globals.get("__file__"), visited)
        frame = frame.f_back
    if main and visited:
        return
    # A thread that was handed `model_path` itself has no frame of the script. At a prompt argv[0]
    # is the shell that was started, unless a script was run before.
    command = sys.argv[0] if sys.argv else ""
    if command.endswith(".py") or not hasattr(sys, "ps1"):
        yield from _start_at(command, visited)
    yield from _start_at(getattr(sys.modules.get("__main__"), "__file__", None), visited)
    if not visited:
        yield from _working_folders()[:1]


def _start_at(file: object, visited: set[str]) -> Iterator[Path]:
    """The path of a `__file__`, unless it was visited before or belongs to a library."""
    if not isinstance(file, str) or file in visited:
        return
    path = Path(file)
    if not path.is_absolute():
        path = next((base / path for base in _working_folders() if _is_file(base / path)), path)
    if not path.is_absolute() or _is_library(path):
        return
    visited.add(file)
    yield path


def _working_folders() -> tuple[Path, ...]:
    """The folders that a `__file__` may be relative to; a script can change folder as it runs."""
    folders = (_current_folder(), _IMPORT_FOLDER)
    return tuple(folder for folder in folders if folder is not None)


def _is_library(path: Path) -> bool:
    """Whether a file is installed: a course may hold the environment that its scripts run in."""
    return not {"site-packages", "dist-packages"}.isdisjoint(path.parts) or path.is_relative_to(
        _STANDARD_LIBRARY
    )


def _find_root(start: Path) -> Path | None:
    """The course root at or above a path, as it is named and then with links resolved.

    One with a map wins over one without.
    """
    bases = (Path(os.path.normpath(start)), Path(os.path.realpath(start)))
    folders = [folder for base in bases for folder in (base, *base.parents)]
    for is_root in (_has_map, _is_download):
        for folder in folders:
            if is_root(folder):
                return folder
    return None


def _has_map(folder: Path) -> bool:
    return _is_file(folder / "content" / "course.toml")


def _is_download(folder: Path) -> bool:
    return _is_folder(folder / "models") and _is_folder(folder / "examples")


def _describe_missing(name: str, stem: str, models: Path) -> str:
    """The message about a missing model."""
    if not _is_folder(models):
        return f"no model {name!r}: there is no folder {models}"
    names = sorted(_model_names(models))
    if not names:
        return f"no model {name!r}: {models} holds no {_SUFFIX} file"
    suggestions = _find_similar(stem, names)
    if suggestions:
        return f"no model {name!r} in {models}; did you mean {_join_with_or(suggestions)}?"
    listing = ", ".join(map(repr, names[:_MOST_LISTED]))
    remainder = f" and {len(names) - _MOST_LISTED} more" if len(names) > _MOST_LISTED else ""
    return f"no model {name!r} in {models}, which has {listing}{remainder}"


def _model_names(models: Path) -> Iterator[str]:
    for folder, _, files in os.walk(models):
        subfolder = PurePosixPath(Path(folder).relative_to(models).as_posix())
        yield from (
            str(subfolder / file.removesuffix(_SUFFIX)) for file in files if file.endswith(_SUFFIX)
        )


def _find_similar(stem: str, names: Iterable[str]) -> tuple[str, ...]:
    """The names most similar to `stem`, best first, compared whole and by their last parts."""
    whole = stem.casefold()

    def likeness(name: str) -> float:
        folded = name.casefold()
        pairs = ((whole, folded), (whole.rpartition("/")[2], folded.rpartition("/")[2]))
        ratio = max(difflib.SequenceMatcher(None, a, b).ratio() for a, b in pairs)
        return max(ratio, _LIKENESS) if len(whole) > 2 and whole in folded else ratio

    scored = sorted((-likeness(name), name) for name in names)
    return tuple(name for score, name in scored[:3] if -score >= _LIKENESS)


def _join_with_or(names: tuple[str, ...]) -> str:
    *first, last = map(repr, names)
    return f"{', '.join(first)} or {last}" if first else last


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except OSError:
        return False


def _is_folder(path: Path) -> bool:
    try:
        return path.is_dir()
    except OSError:
        return False


def _current_folder() -> Path | None:
    try:
        return Path.cwd()
    except OSError:
        return None


_IMPORT_FOLDER = _current_folder()
_STANDARD_LIBRARY = Path(os.__file__).parent
