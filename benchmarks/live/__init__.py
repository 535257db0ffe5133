"""The live loop without ROS: simulated streams through estimator and diagnosis, quicker than real.

`python -m benchmarks.live --out out/live` writes one JSON line a stream and a table.
"""

import os

# As in the nodes: threads of small matrices wait for each other, and their waiting counts as time
# that a diagnosis took.
os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')
