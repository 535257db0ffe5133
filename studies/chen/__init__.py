"""Study of Chen et al. on reconstructed tests, every table and figure beside our numbers."""

# Before numpy: the package decides how many threads its linear algebra takes.
import actuator_glue as actuator_glue
