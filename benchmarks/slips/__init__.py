"""Mistakes in the files of a course, made by machine: what `benchmarks/mistakes.py` tries."""
