"""The hard cases by name (P01 ...): numeric and protocol situations that break naive designs (docs/hard_cases.md).

Each case makes its input, runs the oracle, the golden model and on request the RTL, and gives figures beside bounds.
"""
