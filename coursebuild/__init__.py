"""coursebuild: a compiler for executable textbooks about simulation."""

import atexit
import gc

__version__ = "0.1.0"

# Who owns the repository, and where its site is: every link that the tool, its package and its
# messages have comes from here. While an address is not known, there is no link.
REPOSITORY = ""
"""Such as `https://github.com/NAME/coursebuild`."""
SITE = ""
"""Where the course of the repository is published, with the manual in `docs/`; ends in a slash."""
MANUAL = SITE and f"{SITE}docs/"

# The last garbage collection of a process can crash among msgspec's classes (its issue 717), and
# takes time for nothing: leave it out.
atexit.register(gc.freeze)
