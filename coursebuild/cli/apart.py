"""The process of a command that computes with MuJoCo, in the place of the tool's own.

MuJoCo starts Python when it is imported, so that happens in a private folder. The command itself
works where it was given.
"""

from __future__ import annotations

import os
import sys

from coursebuild.core.files.locks import temporary_folder


def main() -> None:
    """Run the command that the arguments are."""
    folder_of_user = os.open(".", os.O_RDONLY)
    with temporary_folder() as folder:
        os.chdir(folder)
        import mujoco  # noqa: F401  # what the command imports later is then there

        os.fchdir(folder_of_user)
    os.close(folder_of_user)
    from coursebuild.cli import main as run

    sys.exit(run())


if __name__ == "__main__":
    main()
