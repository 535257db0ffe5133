"""Records with counted samples, simulated free-run and refitted by least squares."""
