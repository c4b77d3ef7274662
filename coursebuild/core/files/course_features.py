"""The features that a course brings itself: Python files that its map names, run here.

Entry point: `load_course_features`. They are as trusted as the course's scripts are.
"""

from __future__ import annotations

import hashlib
import sys
from pathlib import Path
from traceback import extract_tb
from types import ModuleType

from coursebuild.core.features import Feature
from coursebuild.core.files.errors import EffectError
from coursebuild.core.files.read import read_bytes
from coursebuild.core.model import Course, NamedPath
from coursebuild.core.registry import clash, installed_features, use_course_features
from coursebuild.core.text.diagnostics import Diagnostic, diagnose


def load_course_features(root: Path, course: Course) -> tuple[Diagnostic, ...]:
    """Make the features of a course those of this process; what is wrong with them."""
    found: list[Feature] = []
    wrong: list[Diagnostic] = []
    digest = hashlib.sha256()

    def tell(named: NamedPath, message: str, mend: str = "correct the file") -> None:
        help = f"{mend}, or take it out of `features` in the map"
        wrong.append(diagnose("feature-broken", named.span, message, help=help))

    for named in course.features:
        try:
            code = read_bytes(root, named.path)
        except EffectError as error:
            tell(named, error.message, "write it, as `coursebuild new feature NAME` does")
            continue
        digest.update(named.path.encode() + b"\0" + code + b"\0")
        feature = _run(named.path, code)
        if isinstance(feature, str):
            tell(named, feature)
        elif reason := clash(feature, (*installed_features(), *found)):
            tell(named, f"{named.path}: {reason}")
        else:
            found.append(feature)
    use_course_features(found, digest.hexdigest() if course.features else "")
    return tuple(wrong)


def _run(path: str, code: bytes) -> Feature | str:
    """The feature of a file, or why there is none.

    An unchanged file is not run again: blocks that were read would be of another class than those
    that are read now.
    """
    known = _last.get(path)
    if known is None or known[0] != code:
        known = _last[path] = code, _first_run(path, code)
    return known[1]


_last: dict[str, tuple[bytes, Feature | str]] = {}
"""By path: the code that was run last, and what came of it."""


def _first_run(path: str, code: bytes) -> Feature | str:
    module = ModuleType(f"course_{path.removesuffix('.py').replace('/', '.')}")
    module.__file__ = path
    sys.modules[module.__name__] = module  # where kept values of its classes look for these
    try:
        exec(compile(code, path, "exec"), module.__dict__)
    except (Exception, SystemExit) as error:  # whatever an author's code raises
        lines = [f.lineno for f in extract_tb(error.__traceback__) if f.filename == path]
        place = f" at line {lines[-1]}" if lines else ""
        return f"{path} fails{place}: {type(error).__name__}: {error}"
    feature = getattr(module, "FEATURE", None)
    return (
        feature
        if isinstance(feature, Feature)
        else f"{path} has no FEATURE of the type `coursebuild.core.features.Feature`"
    )
