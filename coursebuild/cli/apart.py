"""The process of a command that computes with MuJoCo, in the place of the tool's own.

MuJoCo starts Python when it is imported, so that happens in a private folder. The command itself
works where it was given.
"""

from __future__ import annotations

import contextlib
import os
import sys

from coursebuild.core.files.locks import temporary_folder


def main() -> None:
    """Run the command that the arguments are."""
    with contextlib.ExitStack() as resources:
        with contextlib.suppress(OSError):  # the folder of the user may be gone
            user_folder = os.open(".", os.O_RDONLY)
            resources.callback(os.close, user_folder)
            resources.callback(os.fchdir, user_folder)
        os.chdir(resources.enter_context(temporary_folder()))
        with contextlib.suppress(ImportError):  # the command tells that
            import mujoco  # noqa: F401  # what the command imports later is then there
    from coursebuild.cli import main as run

    sys.exit(run())


if __name__ == "__main__":
    main()
