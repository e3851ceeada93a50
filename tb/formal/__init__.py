"""Properties and the settings of their proofs."""
