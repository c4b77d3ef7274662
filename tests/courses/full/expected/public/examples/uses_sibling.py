import sys

import numpy as np
from values import math

print(sys.argv[0], sys.argv[1:])
print(__file__, __name__)
print("value", np.float64(math.tau) * (1 + 1e-9))
