"""The disk: a course's files as sources, and what the tool writes without losing any."""
