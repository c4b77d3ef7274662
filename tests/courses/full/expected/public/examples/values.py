# /// script
# requires-python = ">=3.11"
# dependencies = []
# ///
"""Numbers of every kind."""

import math

print("pi     ", round(math.pi, 8))
print("minus  ", -1 / 3)
print("count  ", 12)
print("special", math.nan, -math.inf)
