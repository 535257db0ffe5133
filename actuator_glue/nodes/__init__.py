"""ROS 2 nodes: each converts, hands on, publishes."""

import os

# A node and its workers share few cores: threads of the linear algebra on top would only wait for
# each other. A value set by the user stands.
os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')
