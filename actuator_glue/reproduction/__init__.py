"""The paper's complete study on data reconstructed from its Eqs. (3a) and (3b)."""
