"""The vocabulary of every course: the kinds of callouts, and closed forms to measure against.

Entry points: `CALLOUTS` and `CLOSED_FORMS`. A course can add kinds of callouts, or relabel these,
under `[callouts]` in course.toml.
"""

from __future__ import annotations

from coursebuild.core.model import CalloutKind

CALLOUTS: tuple[CalloutKind, ...] = (
    CalloutKind(
        "established",
        "Established",
        "Checked against the engine's documentation, or measured by a script of this course.",
    ),
    CalloutKind(
        "derivation", "Derivation", "Follows from what came before, and every step is written out."
    ),
    CalloutKind(
        "implementation",
        "Implementation",
        "How the engine or the code does it; another engine may do it differently.",
    ),
    CalloutKind(
        "recommendation",
        "Recommendation",
        "Advice from experience: sound as a default, and open to a better argument.",
    ),
    CalloutKind(
        "research", "Research", "What the literature says, or where it is still open, with sources."
    ),
    CalloutKind(
        "unverified",
        "Unverified",
        "Believed to be so, and checked by nobody here.",
    ),
    CalloutKind(
        "version", "Version", "Holds for the version named, and may be different in another."
    ),
    CalloutKind("warning", "Warning", "Something here goes wrong easily, or costs dearly."),
    CalloutKind("try", "Try it", "Something to do before reading on."),
    CalloutKind(
        "solution", "Solution", "A worked answer, its scripts verified; best read after one's own."
    ),
    CalloutKind("note", "Note", "A remark beside the main line."),
    CalloutKind("tip", "Tip", "A way to save time or trouble."),
    CalloutKind("important", "Important", "What the rest of the lesson depends on."),
    CalloutKind("caution", "Caution", "A step that cannot be taken back, or may damage something."),
)
"""In the order of a page that explains them."""

CLOSED_FORMS: tuple[str, ...] = (
    "tumbling-box",
    "pendulum-hinge-90",
    "pendulum-hinge-179",
    "pendulum-ball-90",
    "pendulum-ball-179",
    "pendulum-connect-90",
    "pendulum-connect-179",
    "free-top",
    "thin-rod",
    "coin",
    "heavy-top",
    "projectile",
    "damped-spring-0",
    "damped-spring-0.1",
    "damped-spring-1",
    "damped-spring-10",
    "stiff-servo-0.1",
    "stiff-servo-1",
    "stiff-servo-10",
    "sliding-block-elliptic-along",
    "sliding-block-elliptic-across",
    "sliding-block-pyramidal-along",
    "sliding-block-pyramidal-across",
    "rolling-ball-elliptic",
    "rolling-ball-pyramidal",
    "sticking-block-elliptic",
    "sticking-block-pyramidal",
    "elastic-impact",
    "newtons-cradle",
    "stack-1",
    "stack-10",
    "stack-100",
    "stack-1000",
    "stack-10000",
    "soft-equality-0.1",
    "soft-equality-1",
    "millimetre-cube",
    "distant-body",
    "flat-plate",
)
"""The hard cases whose exact motion is a formula: a scenario may name one as its reference."""
