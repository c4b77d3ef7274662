# /// script
# requires-python = ">=3.11"
# dependencies = []
# ///
for i in range(9):
    print("line", i, "of 9")
