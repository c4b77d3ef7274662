"""Every routine says of every argument what shape and what numbers it wants."""

import inspect
from collections.abc import Callable

import numpy as np

from mjcourse import spatial

Q, V, M, S = (4,), (3,), (3, 3), ()
SIGNATURES: dict[str, dict[str, tuple[int, ...]]] = {
    "angular_distance": {"a": Q, "b": Q},
    "axis_angle_to_quat": {"axis": V, "angle": S},
    "box_inertia": {"mass": S, "half_sizes": V},
    "capsule_inertia": {"mass": S, "radius": S, "half_length": S},
    "cross_force": {"velocity": (6,), "force": (6,)},
    "cross_motion": {"velocity": (6,), "motion": (6,)},
    "cylinder_inertia": {"mass": S, "radius": S, "half_length": S},
    "ellipsoid_inertia": {"mass": S, "semi_axes": V},
    "euler_to_quat": {"angles": V},
    "exp_so3": {"rotvec": V},
    "force_transform": {"rot": M, "pos": V},
    "inertia_from_principal": {"moments": V, "quat": Q},
    "is_physical_inertia": {"inertia": M},
    "log_so3": {"mat": M},
    "mat_to_quat": {"mat": M},
    "motion_transform": {"rot": M, "pos": V},
    "parallel_axis": {"inertia": M, "mass": S, "offset": V},
    "pose_compose": {"rot1": M, "pos1": V, "rot2": M, "pos2": V},
    "pose_inverse": {"rot": M, "pos": V},
    "principal_axes": {"inertia": M},
    "quat_conj": {"quat": Q},
    "quat_integrate": {"quat": Q, "angvel": V, "dt": S},
    "quat_mul": {"a": Q, "b": Q},
    "quat_normalize": {"quat": Q},
    "quat_rotate": {"quat": Q, "vector": V},
    "quat_slerp": {"a": Q, "b": Q, "t": S},
    "quat_sub": {"a": Q, "b": Q},
    "quat_to_euler": {"quat": Q},
    "quat_to_mat": {"quat": Q},
    "quat_to_rotvec": {"quat": Q},
    "rotate_inertia": {"inertia": M, "rot": M},
    "rotvec_to_quat": {"rotvec": V},
    "skew": {"vector": V},
    "spatial_inertia": {"mass": S, "com": V, "inertia": M},
    "sphere_inertia": {"mass": S, "radius": S},
    "split_spatial_inertia": {"spatial": (6, 6)},
    "transform_spatial_inertia": {"spatial": (6, 6), "rot": M, "pos": V},
    "unskew": {"mat": M},
}
"""`compose_inertia`, whose leading axes are not all alike, has tests of its own."""

ARGUMENTS = [
    (name, argument, core)
    for name, wanted in SIGNATURES.items()
    for argument, core in wanted.items()
]


def routine(name: str) -> Callable[..., object]:
    found = getattr(spatial, name)
    assert callable(found)
    return found


def valid(shape: tuple[int, ...], lead: tuple[int, ...] = ()) -> np.ndarray:
    entry = np.eye(shape[0]) if len(shape) == 2 else np.ones(shape)
    return np.broadcast_to(entry, (*lead, *shape))


def written(shape: tuple[int, ...]) -> str:
    return f"({', '.join(('...', *map(str, shape)))})"


def test_every_routine_is_listed() -> None:
    assert sorted(spatial.__all__) == sorted({*SIGNATURES, "compose_inertia"})
    for name, wanted in SIGNATURES.items():
        parameters = inspect.signature(routine(name)).parameters
        assert [p for p in parameters if p not in ("seq", "rtol")] == list(wanted)


def answer(name: str, **changed: object) -> str:
    """What a routine says to arguments that are valid but for those that are given."""
    arguments = {key: valid(shape) for key, shape in SIGNATURES[name].items()}
    try:
        routine(name)(**{**arguments, **changed})
    except (TypeError, ValueError) as error:
        return f"{type(error).__name__}: {error}"
    return "nothing"


def test_a_bad_shape_says_what_was_expected_and_what_came() -> None:
    wrong = []
    for name, argument, core in ARGUMENTS:
        if not core:
            continue
        for shape in ((), (5,), (2, *core[:-1], core[-1] + 1), core[1:], (0,)):
            said = answer(name, **{argument: np.ones(shape)})
            if said != f"ValueError: {argument} must have shape {written(core)}, got {shape}":
                wrong.append((name, argument, shape, said))
    assert wrong == []


def test_what_is_no_number_is_an_error() -> None:
    wrong = []
    for name, argument, core in ARGUMENTS:
        for value, dtype in ((1j, "complex128"), (None, "object"), ("1", "<U1")):
            said = answer(name, **{argument: np.full(core, value)})
            if said != f"TypeError: {argument} must hold real numbers, got dtype {dtype}":
                wrong.append((name, argument, value, said))
    assert wrong == []


def test_a_ragged_sequence_is_an_error() -> None:
    wrong = []
    for name, argument, core in ARGUMENTS:
        said = answer(name, **{argument: [[1.0, 2.0], [3.0]]})
        expected = f"{argument} must have shape {written(core)}, got a ragged sequence"
        if said != f"ValueError: {expected}":
            wrong.append((name, argument, said))
    assert wrong == []


def test_leading_shapes_that_do_not_broadcast_are_named() -> None:
    wrong = []
    for name, wanted in SIGNATURES.items():
        if len(wanted) == 1:
            continue
        leads = [(2,), (3,), (1,), (1,)][: len(wanted)]
        parts = zip(wanted.items(), leads, strict=True)
        said = answer(name, **{key: valid(shape, lead) for (key, shape), lead in parts})
        shapes = ", ".join(f"{key} {lead}" for key, lead in zip(wanted, leads, strict=True))
        if name == "transform_spatial_inertia":
            shapes = "spatial (2,), pose (3,)"  # rot and pos were taken together before
        if said != f"ValueError: leading shapes do not broadcast: {shapes}":
            wrong.append((name, said))
    assert wrong == []


def parts(result: object) -> tuple[object, ...]:
    return result if isinstance(result, tuple) else (result,)


def test_an_empty_batch_gives_an_empty_one() -> None:
    for name, wanted in SIGNATURES.items():
        first, *_ = parts(routine(name)(*(valid(shape, (0,)) for shape in wanted.values())))
        assert isinstance(first, np.ndarray), name
        assert first.shape[0] == 0, name


def test_lists_and_other_dtypes_are_taken_as_doubles() -> None:
    wrong = []
    for name, wanted in SIGNATURES.items():
        arguments = [valid(shape) for shape in wanted.values()]
        double = parts(routine(name)(*arguments))
        for kind, given in (
            ("lists", [argument.tolist() for argument in arguments]),
            ("float32", [argument.astype(np.float32) for argument in arguments]),
            ("int8", [argument.astype(np.int8) for argument in arguments]),
        ):
            for one, two in zip(double, parts(routine(name)(*given)), strict=True):
                alike = np.array_equal(np.asarray(one), np.asarray(two))
                if not alike or np.asarray(one).dtype != np.asarray(two).dtype:
                    wrong.append((name, kind, one, two))
    assert wrong == []


def test_arguments_are_neither_changed_nor_returned() -> None:
    for name, wanted in SIGNATURES.items():
        arguments = [np.array(valid(shape)) for shape in wanted.values()]
        for argument in arguments:
            argument.setflags(write=False)
        for part in parts(routine(name)(*arguments)):
            assert not any(np.shares_memory(part, argument) for argument in arguments), name
            if isinstance(part, np.ndarray):
                assert part.flags.writeable, name
                assert part.ndim > 0, name
