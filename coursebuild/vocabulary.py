"""The words that every course has: the kinds of callouts, and what each promises.

Entry point: `CALLOUTS`. A course can add kinds, or give these other labels, under `[callouts]` in
course.toml.
"""

from __future__ import annotations

from coursebuild.model import CalloutKind

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
    CalloutKind("note", "Note", "A remark beside the main line."),
    CalloutKind("tip", "Tip", "A way to save time or trouble."),
    CalloutKind("important", "Important", "What the rest of the lesson leans on."),
    CalloutKind("caution", "Caution", "A step that cannot be taken back, or may damage something."),
)
"""In the order in which a page that explains them lists them."""
