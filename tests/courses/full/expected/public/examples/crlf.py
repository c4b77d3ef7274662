# /// script
# requires-python = ">=3.11"
# dependencies = []
# ///
text = """one
two"""
print(repr(text))
