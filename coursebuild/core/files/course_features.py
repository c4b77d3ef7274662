"""The features that a course brings itself: Python files that its map names, run here.

Entry point: `load_course_features`. They are as trusted as the course's scripts are.
"""

from __future__ import annotations

import hashlib
import sys
from pathlib import Path
from types import ModuleType

from coursebuild.core.features import Feature
from coursebuild.core.files.errors import EffectError
from coursebuild.core.files.read import read_bytes
from coursebuild.core.model import Course, CourseFeature
from coursebuild.core.registry import clash, installed_features, use_course_features
from coursebuild.core.text.diagnostics import Diagnostic, diagnose


def load_course_features(root: Path, course: Course) -> tuple[Diagnostic, ...]:
    """Make the features of a course those of this process; what is wrong with them."""
    found: list[Feature] = []
    wrong: list[Diagnostic] = []
    digest = hashlib.sha256()
    for named in course.features:
        try:
            code = read_bytes(root, named.path)
        except EffectError as error:
            wrong.append(diagnose("feature-broken", named.span, error.message))
            continue
        digest.update(named.path.encode() + b"\0" + code + b"\0")
        feature = _run(named, code)
        if isinstance(feature, Diagnostic):
            wrong.append(feature)
        elif reason := clash(feature, (*installed_features(), *found)):
            wrong.append(diagnose("feature-broken", named.span, f"{named.path}: {reason}"))
        else:
            found.append(feature)
    use_course_features(found, digest.hexdigest() if course.features else "")
    return tuple(wrong)


def _run(named: CourseFeature, code: bytes) -> Feature | Diagnostic:
    module = ModuleType(f"course_{named.path.removesuffix('.py').replace('/', '.')}")
    module.__file__ = named.path
    sys.modules[module.__name__] = module  # where kept values of its classes look for these
    try:
        exec(compile(code, named.path, "exec"), module.__dict__)
    except (Exception, SystemExit) as error:  # whatever an author's code raises
        message = f"{named.path} fails: {type(error).__name__}: {error}"
        return diagnose("feature-broken", named.span, message)
    feature = getattr(module, "FEATURE", None)
    if isinstance(feature, Feature):
        return feature
    message = f"{named.path} has no FEATURE"
    help = "give it one, of the type coursebuild.core.features.Feature"
    return diagnose("feature-broken", named.span, message, help=help)
