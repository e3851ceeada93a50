"""The hard cases by name (D-P01 ...): numeric and protocol situations that break naive designs."""
