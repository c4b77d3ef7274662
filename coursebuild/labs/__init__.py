"""Labs, pure: their code as a module, what a trial does and found, and their static form.

Entry points: `compile.compile_lab`.
"""
