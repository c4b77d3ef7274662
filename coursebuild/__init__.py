"""coursebuild: a compiler for executable textbooks about simulation."""

__version__ = "0.1.0"
