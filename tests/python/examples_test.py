#!/usr/bin/env python3
"""Every example is short, and makes the picture that lies beside it."""

import pathlib
import subprocess
import sys
import tempfile
import unittest

import numpy as np
from shapes import read_png

EXAMPLES = pathlib.Path(__file__).resolve().parents[2] / "host/python/examples"


class Examples(unittest.TestCase):
    def test_each_makes_its_picture(self):
        scripts = sorted(EXAMPLES.glob("*.py"))
        self.assertGreaterEqual(len(scripts), 5)
        with tempfile.TemporaryDirectory() as folder:
            for script in scripts:
                with self.subTest(script.name):
                    self.assertLessEqual(len(script.read_text().splitlines()), 40)
                    made, kept = pathlib.Path(folder) / "made.png", script.with_suffix(".png")
                    subprocess.run([sys.executable, script, made], check=True, stderr=subprocess.DEVNULL, timeout=600)
                    found, expected = (read_png(path.read_bytes()).astype(int) for path in (made, kept))
                    self.assertEqual(found.shape, expected.shape)
                    # Hits and pictures have the same bits everywhere; NumPy's sines and sums may not.
                    self.assertGreater(np.mean(np.abs(found - expected) <= 2), 0.998)
                    self.assertLess(kept.stat().st_size, 60_000)


if __name__ == "__main__":
    unittest.main()
