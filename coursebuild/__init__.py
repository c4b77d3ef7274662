"""coursebuild: a compiler for executable textbooks about simulation."""

import atexit
import gc

__version__ = "0.1.0"

# The last garbage collection of a process can crash among msgspec's classes (its issue 717), and
# takes time for nothing: leave it out.
atexit.register(gc.freeze)
