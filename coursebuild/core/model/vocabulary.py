"""The vocabulary of every course: callouts, captions, closed forms to measure against."""

from __future__ import annotations

from msgspec import Struct

CALLOUTS: tuple[str, ...] = tuple(
    """
    established derivation implementation recommendation research unverified version warning
    try solution note tip important caution
    """.split()
)
"""Their labels and promises are interface texts, `callout.NAME` and `promise.NAME`."""


class Words(Struct, frozen=True):
    """The words by which a text is read: `Output:` above an output, mentions as in "Lesson 4.3".

    Of a course in another language they are the interface texts `words.…`, then the English ones.
    """

    output: tuple[str, ...] = ("Output",)
    unlike: tuple[str, ...] = ("Outfit", "Outlet", "Outset")
    """Words that differ from these by a letter or two, and that nobody misspelt."""
    lesson: tuple[str, ...] = ("Lesson",)
    lessons: tuple[str, ...] = ("Lessons",)
    level: tuple[str, ...] = ("Level",)
    levels: tuple[str, ...] = ("Levels",)
    conjunctions: tuple[str, ...] = ("and", "or", "to")
    """Between the numbers of lessons or levels."""


ENGLISH = Words()

CLOSED_FORMS: tuple[str, ...] = tuple(
    """
    tumbling-box pendulum-hinge-90 pendulum-hinge-179 pendulum-ball-90 pendulum-ball-179
    pendulum-connect-90 pendulum-connect-179 free-top thin-rod coin heavy-top projectile
    damped-spring-0 damped-spring-0.1 damped-spring-1 damped-spring-10 stiff-servo-0.1
    stiff-servo-1 stiff-servo-10 sliding-block-elliptic-along sliding-block-elliptic-across
    sliding-block-pyramidal-along sliding-block-pyramidal-across rolling-ball-elliptic
    rolling-ball-pyramidal sticking-block-elliptic sticking-block-pyramidal elastic-impact
    newtons-cradle stack-1 stack-10 stack-100 stack-1000 stack-10000 soft-equality-0.1
    soft-equality-1 millimetre-cube distant-body flat-plate
    """.split()
)
"""The hard cases whose exact motion is a formula: a scenario may name one as its reference."""

MJCF_KEYWORDS = frozenset("true false auto enable disable degree radian local global".split())
"""Keywords of MJCF that have no name in MuJoCo's enumerations."""
