"""ROS 2 nodes: each converts, hands on, publishes."""
