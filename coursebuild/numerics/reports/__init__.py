"""What was measured on MuJoCo, as values: they are kept, printed and drawn, and shown on pages.

`cases`: the hard cases. `bench`: speed against error of a model's scenarios. Nothing here measures.
"""
