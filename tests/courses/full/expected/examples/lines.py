for i in range(9):
    print("line", i, "of 9")
