"""The live loop without ROS: simulated streams through estimator and diagnosis, quicker than real.

`python -m benchmarks.live --out out/live` writes one JSON line a stream and a table.
"""
