"""How fast, accurate and stable MuJoCo is, and what a model can be without. It can be read alone.

Entry points: `problems` (hard cases with exact solutions), `measure` (errors, orders, drifts),
`stability` (largest stable timesteps), `bench` (speed against error of any model), `pruning` (what
a model's scenarios do not need), `reports` (what was measured, as values). Values in, values out:
nothing here reads a file, a clock or the environment.
"""
