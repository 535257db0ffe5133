"""Studies made with actuator_glue, outside the package that is installed."""
