"""Behaves as if matplotlib were not installed."""

raise ImportError("matplotlib is hidden from this test")
