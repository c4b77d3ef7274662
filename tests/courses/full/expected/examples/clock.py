import time

print("took", time.perf_counter_ns(), "ns")
