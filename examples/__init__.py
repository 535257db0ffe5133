"""Examples of what can be built on actuator_glue, outside the package that is installed."""
