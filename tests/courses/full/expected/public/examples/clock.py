# /// script
# requires-python = ">=3.11"
# dependencies = []
# ///
import time

print("took", time.perf_counter_ns(), "ns")
