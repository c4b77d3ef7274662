"""What the scripts of a course import.

Entry points: `model_path`, which finds a model of the course that the calling script belongs to,
and `spatial`, the algebra of rotations, spatial vectors and inertias in MuJoCo's conventions. Only
NumPy is imported.
"""

from mjcourse import spatial
from mjcourse.paths import ModelNotFoundError, model_path

__all__ = ["ModelNotFoundError", "model_path", "spatial"]
