"""How well a structure explains the samples: block scores, noise, the weight of a structure."""
