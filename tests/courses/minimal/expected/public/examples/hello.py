print("hello", 3.14159)
