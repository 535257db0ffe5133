"""The paper's figures drawn from our numbers, one file per group of figures."""
