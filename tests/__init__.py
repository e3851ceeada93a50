"""Tests: builds of the benches, and everything that needs no simulator."""
