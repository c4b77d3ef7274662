print("exactly   this")
print()
print("trailing white space   ")
