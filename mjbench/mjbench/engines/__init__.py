"""Other engines on the same model: what they compute, what a step costs in them, what they refuse.

A module of engines has a table `ENGINES` of `engine_trial.Engine` by the name that `--engines`
takes. It imports the packages of an engine in its functions, which only a child process calls; so
one file more, and its name in `MODULES`, is an engine more.
"""

MODULES = tuple(f"{__name__}.{name}_engine" for name in ("native", "mjx", "warp"))
"""The modules of engines, in the order of reports."""
