"""How fast, accurate and stable MuJoCo is, and what a model can be without.

Values in, values out: nothing here reads a file, a clock or the environment.
"""
