"""What `import actuator_glue` offers: records in, typed results out; no printing, no ROS."""
