print("a page may have scripts")
