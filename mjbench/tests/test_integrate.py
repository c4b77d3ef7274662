"""The integration that references rest on."""

from __future__ import annotations

import decimal
from decimal import Decimal

import numpy as np
import pytest

from mjbench.integrate import (
    NoConvergenceError,
    State,
    bulirsch_stoer,
    cumulative_integral,
    dop853,
)

TIMES = np.linspace(0.25, 20.0, 80)


def test_two_methods_agree_on_an_orbit_of_high_eccentricity() -> None:
    def rate(y: State) -> State:
        cube = (y[0] ** 2 + y[1] ** 2) ** 1.5
        return np.array([y[2], y[3], -y[0] / cube, -y[1] / cube])

    start = np.array([0.2, 0.0, 0.0, 3.0])  # e = 0.8
    states = bulirsch_stoer(rate, start, TIMES)
    # A relative error of 1e-13 in a step moves the phase by this after three turns.
    assert np.max(np.abs(states - dop853(rate, start, TIMES))) < 1e-8
    energy = (states[:, 2] ** 2 + states[:, 3] ** 2) / 2 - 1 / np.hypot(states[:, 0], states[:, 1])
    assert np.max(np.abs(energy + 0.5)) < 1e-12


def test_decimal_numbers_have_the_digits_that_were_asked_for() -> None:
    with decimal.localcontext(decimal.Context(prec=40)):
        start = np.array([Decimal(1)], dtype=object)
        states = bulirsch_stoer(lambda y: -y, start, np.array([1.0, 2.0]), 1e-30, columns=12)
        for row, time in zip(states, (1, 2), strict=True):
            assert abs(row[0] - Decimal(-time).exp()) < Decimal("1e-29")


def test_a_solution_that_ends_is_not_passed() -> None:
    for method in (bulirsch_stoer, dop853):
        states = method(lambda y: y * y, np.array([1.0]), np.array([0.0, 0.5, 0.9]))
        assert np.max(np.abs(states[:, 0] / [1.0, 2.0, 10.0] - 1)) < 1e-11
        with pytest.raises(NoConvergenceError, match="no step is small enough at 1 s"):
            method(lambda y: y * y, np.array([1.0]), np.array([2.0]))


def test_quadrature_to_each_time() -> None:
    times = np.array([0.1, 0.5, 3.0, 3.5])
    integral = cumulative_integral(lambda t: np.exp(-t) * np.sin(9 * t), times, 0.2)
    exact = (9 - np.exp(-times) * (np.sin(9 * times) + 9 * np.cos(9 * times))) / 82
    assert np.max(np.abs(integral - exact)) < 1e-15
