"""Live streams of laboratories, without ROS: transports, layouts, sequences, clocks."""
