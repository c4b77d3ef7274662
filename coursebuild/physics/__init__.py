"""Accuracy and stability of MuJoCo: hard cases with exact references, and what is measured on them.

Entry points: `problems` (the hard cases), `measure` (errors, orders, drifts), `stability` (largest
stable timesteps), `bench` (speed against error of any model). Values in, values out; nothing here
reads a file, a clock or the environment.
"""
