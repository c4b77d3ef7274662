"""What parts of the tool consist of, by their content.

Entry point: `code_digest(*parts)`: results that take minutes to measure are kept as long as the
code that measures them is the same, whenever it was installed.
"""

from __future__ import annotations

import hashlib
from pathlib import Path

from coursebuild.core.files.errors import EffectError, reason

_PACKAGES = Path(__file__).parents[3]
"""The folder in which `coursebuild` and `mjcourse` are."""


def code_digest(*parts: str, root: Path = _PACKAGES) -> str:
    """A hash over packages and modules, such as `mjcourse/spatial` or `coursebuild/numerics`.

    Raises:
        FileNotFoundError: the tool has no such part.
        EffectError: it cannot be read.
    """
    digest = hashlib.sha256()
    for part in parts:
        if not (root / part).exists():
            raise FileNotFoundError(part)
    try:
        for whole in (root / part for part in parts):
            for path in (whole,) if whole.is_file() else sorted(whole.rglob("*.py")):
                name = path.relative_to(root).as_posix()
                content = path.read_bytes()
                digest.update(f"{name}\0{len(content)}\0".encode())
                digest.update(content)
    except OSError as error:
        raise EffectError(f"the tool's own code cannot be read: {reason(error)}") from None
    return digest.hexdigest()
