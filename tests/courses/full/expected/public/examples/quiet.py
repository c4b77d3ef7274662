# /// script
# requires-python = ">=3.11"
# dependencies = []
# ///
assert 1 + 1 == 2
