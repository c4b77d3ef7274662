"""Temporary folders.

Entry point: `temporary_folder`.
"""

from __future__ import annotations

import contextlib
import shutil
import tempfile
from collections.abc import Iterator

from coursebuild.core.files.errors import EffectError, reason


@contextlib.contextmanager
def temporary_folder() -> Iterator[str]:
    """A new folder, removed at the end with everything in it.

    Raises:
        EffectError: there is no place for it.
    """
    try:
        folder = tempfile.mkdtemp(prefix="coursebuild.")
    except OSError as error:
        raise EffectError(f"there is no place for temporary files: {reason(error)}") from None
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)
