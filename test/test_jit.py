"""Compiled code gives the same bits in the process that compiles it and in all later ones."""

import os
import subprocess
import sys
from pathlib import Path

# Band limits of a mixture: many sums, in functions that call each other.
WORK = """
import hashlib
import numpy as np
from actuator_glue.online.mixture import mixture_band
rng = np.random.default_rng(0)
time = np.arange(20_000)
draws = 1e-3 * np.sin(time / 50) + rng.standard_normal((200, 1)) * 2e-6 * np.cos(time / 37)
draws += 1e-6 * rng.standard_normal((200, 1))
sd = 1e-5 * (1 + 0.02 * rng.standard_normal(200))
band = mixture_band(draws, 1e-7 * rng.standard_normal(200), sd, (0.5, 0.95))
print(hashlib.sha256(band.lower.tobytes() + band.upper.tobytes()).hexdigest())
"""


def test_fresh_and_cached_code_agree_to_the_bit(tmp_path: Path) -> None:
    """Without forced inlining one limit in 80 000 differed in its last bit."""
    environment = {**os.environ, 'NUMBA_CACHE_DIR': str(tmp_path)}
    compiled, cached = (
        subprocess.run(
            [sys.executable, '-c', WORK],
            env=environment, check=True, capture_output=True, text=True, timeout=300,
        ).stdout
        for _ in range(2)
    )  # fmt: skip
    assert any(tmp_path.rglob('*.nbc'))
    assert compiled == cached
