"""Functions that an exported script brings along: `lib`, and where JavaScript counts otherwise.

Each does what its JavaScript counterpart does, bit for bit where no function of the C library is
involved, for every number: NaN, infinities and the sign of zero included. `library` takes from here
the text of those that a script uses.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterable
from decimal import ROUND_HALF_UP, Context, Decimal
from typing import NamedTuple

import mujoco
import numpy as np


class Energy(NamedTuple):
    """Energies of everything, J."""

    kinetic: float
    potential: float  # of gravity and springs
    total: float


def energy(model: mujoco.MjModel, data: mujoco.MjData) -> Energy:
    """The energy now; `data.energy` stays as it is."""
    before = data.energy.copy()
    flags = data.flg_energypos, data.flg_energyvel
    mujoco.mj_energyPos(model, data)
    mujoco.mj_energyVel(model, data)
    potential, kinetic = data.energy.tolist()
    data.energy[:] = before
    data.flg_energypos, data.flg_energyvel = flags
    return Energy(kinetic, potential, kinetic + potential)


def of_everything(model: mujoco.MjModel, data: mujoco.MjData) -> tuple[np.ndarray, np.ndarray]:
    """Momentum (kg m/s), and angular momentum about the common centre of mass (kg m^2/s)."""
    before = data.subtree_linvel.copy(), data.subtree_angmom.copy()
    flag = data.flg_subtreevel
    mujoco.mj_subtreeVel(model, data)
    linear = data.subtree_linvel[0] * model.body_subtreemass[0]
    angular = data.subtree_angmom[0].copy()
    data.subtree_linvel[:], data.subtree_angmom[:] = before
    data.flg_subtreevel = flag
    return linear, angular


def momentum(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
    """The momentum of everything, kg m/s."""
    return of_everything(model, data)[0]


def angular_momentum(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
    """The angular momentum of everything about its common centre of mass, kg m^2/s."""
    return of_everything(model, data)[1]


def normal_force(
    model: mujoco.MjModel, data: mujoco.MjData, geom: int | str | None = None
) -> float:
    """The normal forces of all contacts, or of those of one geom, added up, in N."""
    only = None if geom is None else model.geom(geom).id
    total, force = 0.0, np.zeros(6)
    for i, contact in enumerate(data.contact):
        if only is None or only in (contact.geom1, contact.geom2):
            mujoco.mj_contactForce(model, data, i, force)
            total += float(force[0])
    return total


def norm(vector: Iterable[float]) -> float:
    """The Euclidean length of a vector."""
    total = 0.0
    for x in vector:
        total += float(x) * float(x)
    return float(np.sqrt(total))


def rad(degrees: float) -> float:
    """An angle in radians."""
    return degrees / (180 / math.pi)


def deg(radians: float) -> float:
    """An angle in degrees."""
    return radians * (180 / math.pi)


def index(number: float) -> int:
    """A number as an index: from 0, and whole."""
    if not (number >= 0 and number == int(number)):
        raise IndexError(f"{number} is no index")
    return int(number)


def maximum(*numbers: float) -> float:
    """The largest of some numbers; NaN if one of them is."""
    if any(math.isnan(x) for x in numbers):
        return math.nan
    return max(numbers, key=lambda x: (x, math.copysign(1.0, x)))


def minimum(*numbers: float) -> float:
    """The smallest of some numbers; NaN if one of them is."""
    if any(math.isnan(x) for x in numbers):
        return math.nan
    return min(numbers, key=lambda x: (x, math.copysign(1.0, x)))


def sign(x: float) -> float:
    """-1.0, 0.0 or 1.0."""
    return x if x == 0 or math.isnan(x) else math.copysign(1.0, x)


def rounded(x: float) -> float:
    """The nearest whole number, and of two the larger."""
    if not math.isfinite(x) or x == 0:
        return x
    down = float(np.floor(x))
    return math.copysign(down + (x - down >= 0.5), x)


def power(base: float, exponent: float) -> float:
    """`base` to the power of `exponent`."""
    if math.isnan(exponent) or (abs(base) == 1 and math.isinf(exponent)):
        return math.nan
    return float(np.power(float(base), float(exponent)))


def numeral(x: float) -> str:
    """A number as JavaScript writes it: with the fewest digits that stand for it."""
    x = float(x)
    if not math.isfinite(x):
        return "NaN" if math.isnan(x) else "Infinity" if x > 0 else "-Infinity"
    if x == 0:
        return "0"
    minus = "-" if x < 0 else ""
    _, written, power = Decimal(repr(abs(x))).as_tuple()
    digits = "".join(map(str, written)).rstrip("0")
    point = len(written) + int(power)
    if 0 < point <= 21:
        digits = digits.ljust(point, "0")
        return minus + ".".join(filter(None, (digits[:point], digits[point:])))
    if -6 < point <= 0:
        return f"{minus}0.{'0' * -point}{digits}"
    return minus + ".".join(filter(None, (digits[0], digits[1:]))) + f"e{point - 1:+d}"


def fixed(x: float, decimals: int) -> str:
    """A number with so many decimals; of two as near the larger, without its sign."""
    x = float(x)
    if not abs(x) < 1e21:
        return numeral(x)
    nearest = Decimal(abs(x)).quantize(Decimal(1).scaleb(-decimals), context=DIGITS)
    return f"{'-' if x < 0 else ''}{nearest:f}"


DIGITS = Context(prec=200, rounding=ROUND_HALF_UP)


def exponential(x: float, decimals: int) -> str:
    """A number with so many decimals and a power of ten."""
    x = float(x)
    if not math.isfinite(x):
        return numeral(x)
    nearest = Context(prec=decimals + 1, rounding=ROUND_HALF_UP).plus(Decimal(abs(x)))
    digits = "".join(map(str, nearest.as_tuple().digits)).ljust(decimals + 1, "0")
    digits = ".".join(filter(None, (digits[0], digits[1:])))
    return f"{'-' if x < 0 else ''}{digits}e{nearest.adjusted():+d}"


def precise(x: float, digits: int) -> str:
    """A number with so many digits in all."""
    x = float(x)
    if not math.isfinite(x):
        return numeral(x)
    nearest = Context(prec=digits, rounding=ROUND_HALF_UP).plus(Decimal(abs(x)))
    if not -6 <= nearest.adjusted() < digits:
        return exponential(x, digits - 1)
    return f"{'-' if x < 0 else ''}{nearest:.{digits - 1 - nearest.adjusted()}f}"


class Random:
    """The lab's random numbers: xoshiro128** by Blackman and Vigna, seeded by splitmix32."""

    def __init__(self, seed: float) -> None:
        self.seed = seed
        self.restart()

    def restart(self) -> None:
        """Begin the sequence again."""
        low, high = struct.unpack("<2I", struct.pack("<d", self.seed))
        z = low ^ high * 0x9E3779B1 & WORD
        state = []
        for _ in range(4):
            z = z + 0x9E3779B9 & WORD
            x = (z ^ z >> 16) * 0x85EBCA6B & WORD
            x = (x ^ x >> 13) * 0xC2B2AE35 & WORD
            state.append(x ^ x >> 16)
        self.state = state

    def __call__(self) -> float:
        """A number in [0, 1)."""
        return ((self._word() >> 5) * 2**26 + (self._word() >> 6)) / 2**53

    def _word(self) -> int:
        a, b, c, d = self.state
        c, d = c ^ a, d ^ b
        self.state = [a ^ d, b ^ c, c ^ b << 9 & WORD, _rotated(d, 11)]
        return _rotated(b * 5 & WORD, 7) * 9 & WORD


def _rotated(x: int, by: int) -> int:
    return (x << by | x >> 32 - by) & WORD


WORD = 2**32 - 1
