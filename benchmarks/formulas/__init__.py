"""Formulas that nobody wrote, each with what SymPy says of it."""
