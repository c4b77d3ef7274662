"""A generator of courses for benchmarks: the same lessons for coursebuild and for its peers.

Entry point: `courses.write_course`. Steps: `topics` reads what a lesson is about, `scripts` makes
its script and runs it for the recorded output, `lesson` composes the pieces of `document`, and a
module of `flavors` writes them in the idiom of one generator of sites.
"""
