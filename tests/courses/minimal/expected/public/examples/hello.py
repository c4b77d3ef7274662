# /// script
# requires-python = ">=3.11"
# dependencies = []
# ///
print("hello", 3.14159)
