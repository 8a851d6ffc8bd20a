"""Behaves as if gymnasium were not installed."""

raise ImportError("gymnasium is hidden from this test")
