"""A simulated laboratory: two years of tests of four actuators, and what is made of them."""
