"""The command line `actuator-glue`, one file per command; needs no ROS."""
