"""The features of a course's own: Python files that its map names, run in this process.

Whoever loads them has to know that this code may run: see `pipeline.load`.
"""

from __future__ import annotations

import contextlib
import hashlib
import sys
from pathlib import Path
from traceback import extract_tb
from types import ModuleType

from coursebuild.core.features import Feature
from coursebuild.core.files.errors import EffectError
from coursebuild.core.files.read import read_bytes
from coursebuild.core.model import Course, NamedPath
from coursebuild.core.registry import find_clash, installed_features, use_course_features
from coursebuild.core.text.diagnostics import Diagnostic, diagnose


def load_course_features(root: Path, course: Course) -> tuple[Diagnostic, ...]:
    """Load the features of a course into this process; return diagnostics about them."""
    features: list[Feature] = []
    diagnostics: list[Diagnostic] = []

    def tell(entry: NamedPath, message: str, mend: str = "correct the file") -> None:
        help = f"{mend}, or take it out of `features` in the map"
        diagnostics.append(diagnose("feature-broken", entry.span, message, help=help))

    for entry in course.features:
        try:
            code = read_bytes(root, entry.path)
        except EffectError as error:
            tell(entry, error.message, "write it, as `coursebuild new feature NAME` does")
            continue
        # An unchanged file is not run again: that would define its classes anew, and blocks read
        # earlier would no longer be instances of them.
        last = _last.get(entry.path)
        if last is None or last[0] != code:
            last = _last[entry.path] = code, _run(entry.path, code)
        feature = last[1]
        if isinstance(feature, str):
            tell(entry, feature)
        elif reason := find_clash(feature, (*installed_features(), *features)):
            tell(entry, f"{entry.path}: {reason}")
        else:
            features.append(feature)
    use_course_features(features, features_digest(root, course) if course.features else "")
    return tuple(diagnostics)


def features_digest(root: Path, course: Course) -> str:
    """A hash of the files of a course's own features."""
    digest = hashlib.sha256()
    for entry in course.features:
        with contextlib.suppress(EffectError):
            digest.update(entry.path.encode() + b"\0" + read_bytes(root, entry.path) + b"\0")
    return digest.hexdigest()


_last: dict[str, tuple[bytes, Feature | str]] = {}
"""By path: the code that was run last, and its feature or message."""


def _run(path: str, code: bytes) -> Feature | str:
    name = f"course_{path.removesuffix('.py').replace('/', '.')}"
    module = sys.modules[name] = ModuleType(name)  # where decoding looks for its classes
    module.__file__ = path
    while name := name.rpartition(".")[0]:  # which it imports
        sys.modules.setdefault(name, ModuleType(name))
    try:
        exec(compile(code, path, "exec"), module.__dict__)
    except (Exception, SystemExit) as error:  # whatever an author's code raises
        lines = [f.lineno for f in extract_tb(error.__traceback__) if f.filename == path]
        place = f" at line {lines[-1]}" if lines else ""
        return f"{path} fails{place}: {type(error).__name__}: {error}"
    feature = getattr(module, "FEATURE", None)
    if isinstance(feature, Feature):
        return feature
    return f"{path} has no FEATURE of the type `coursebuild.api.Feature`"
