"""Random and coverage-guided stimulus: properties in the suite, and for minutes by `python -m tests.fuzz`."""
