"""`make mutate` and `make coverage`: how much of the RTL the benches hold in place. Results: docs/mutation.md."""
