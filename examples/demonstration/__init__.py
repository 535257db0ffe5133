"""The demonstration: the whole suite for a minute and a half, as a user would run it."""

# Before numpy: the package decides how many threads its linear algebra takes.
import actuator_glue as actuator_glue
