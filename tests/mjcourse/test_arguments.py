"""Every argument of every routine says what shape it wants."""

import inspect
from collections.abc import Callable

import numpy as np
import pytest

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

ARGUMENTS = [(name, argument) for name, wanted in SIGNATURES.items() for argument in wanted]


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


@pytest.mark.parametrize(("name", "argument"), ARGUMENTS)
def test_a_bad_shape_says_what_was_expected_and_what_came(name: str, argument: str) -> None:
    wanted = SIGNATURES[name]
    core = wanted[argument]
    if not core:
        return
    for shape in ((), (5,), (2, *core[:-1], core[-1] + 1), core[1:], (0,)):
        arguments = {key: valid(value) for key, value in wanted.items()}
        arguments[argument] = np.ones(shape)
        with pytest.raises(ValueError) as caught:
            routine(name)(**arguments)
        assert str(caught.value) == f"{argument} must have shape {written(core)}, got {shape}"


@pytest.mark.parametrize(("name", "argument"), ARGUMENTS)
def test_what_is_no_number_is_an_error(name: str, argument: str) -> None:
    wanted = SIGNATURES[name]
    for value, dtype in ((1j, "complex128"), (None, "object"), ("1", "<U1")):
        arguments: dict[str, object] = {key: valid(shape) for key, shape in wanted.items()}
        arguments[argument] = np.full(wanted[argument], value)
        with pytest.raises(TypeError) as caught:
            routine(name)(**arguments)
        assert str(caught.value) == f"{argument} must hold real numbers, got dtype {dtype}"


@pytest.mark.parametrize(("name", "argument"), ARGUMENTS)
def test_a_ragged_sequence_is_an_error(name: str, argument: str) -> None:
    wanted = SIGNATURES[name]
    arguments: dict[str, object] = {key: valid(shape) for key, shape in wanted.items()}
    arguments[argument] = [[1.0, 2.0], [3.0]]
    with pytest.raises(ValueError) as caught:
        routine(name)(**arguments)
    expected = f"{argument} must have shape {written(wanted[argument])}, got a ragged sequence"
    assert str(caught.value) == expected


@pytest.mark.parametrize("name", [name for name, wanted in SIGNATURES.items() if len(wanted) > 1])
def test_leading_shapes_that_do_not_broadcast_are_named(name: str) -> None:
    wanted = SIGNATURES[name]
    leads = [(2,), (3,), (1,), (1,)][: len(wanted)]
    arguments = {
        key: valid(shape, lead) for (key, shape), lead in zip(wanted.items(), leads, strict=True)
    }
    with pytest.raises(ValueError) as caught:
        routine(name)(**arguments)
    text = str(caught.value)
    assert text.startswith("leading shapes do not broadcast: ")
    assert "(2,), " in text
    assert "(3,)" in text


def test_text_of_a_broadcast_error() -> None:
    with pytest.raises(ValueError) as caught:
        spatial.quat_slerp(np.ones((2, 4)), np.ones((3, 4)), 0.5)
    assert str(caught.value) == "leading shapes do not broadcast: a (2,), b (3,), t ()"


@pytest.mark.parametrize("name", SIGNATURES)
def test_empty_batches_lists_and_other_dtypes(name: str) -> None:
    wanted = SIGNATURES[name]
    empty = routine(name)(*(valid(shape, (0,)) for shape in wanted.values()))
    first = empty[0] if isinstance(empty, tuple) else empty
    assert isinstance(first, np.ndarray)
    assert first.shape[0] == 0
    double = routine(name)(*(valid(shape) for shape in wanted.values()))
    for given in (
        [valid(shape).tolist() for shape in wanted.values()],
        [valid(shape).astype(np.float32) for shape in wanted.values()],
        [valid(shape).astype(np.int8) for shape in wanted.values()],
    ):
        other = routine(name)(*given)
        for one, two in (
            zip(np.atleast_1d(double), np.atleast_1d(other), strict=True)
            if not (isinstance(double, tuple))
            else zip(double, other, strict=True)
        ):
            assert np.asarray(two).dtype == np.asarray(one).dtype
            assert (np.asarray(one) == np.asarray(two)).all()


@pytest.mark.parametrize("name", SIGNATURES)
def test_arguments_are_neither_changed_nor_returned(name: str) -> None:
    arguments = [np.array(valid(shape)) for shape in SIGNATURES[name].values()]
    for argument in arguments:
        argument.setflags(write=False)
    result = routine(name)(*arguments)
    for part in result if isinstance(result, tuple) else (result,):
        for argument in arguments:
            assert not np.shares_memory(part, argument)
        if isinstance(part, np.ndarray):
            assert part.flags.writeable
            assert part.ndim > 0
