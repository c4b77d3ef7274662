"""How the same lessons are written for each generator of sites, in its own idiom.

A flavor is a module with `write(lessons, folder)`, which makes a folder that the generator builds
with its own command; `courses.FLAVORS` names them.
"""
