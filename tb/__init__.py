"""Benches: cocotb against the golden model, one folder per core."""
