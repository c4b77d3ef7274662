# /// script
# requires-python = ">=3.11"
# dependencies = []
# ///
print("exactly   this")
print()
print("trailing white space   ")
