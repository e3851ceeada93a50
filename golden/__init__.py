"""splatcore's golden model: what the RTL computes, bit for bit, and when, cycle for cycle."""

__version__ = "0.1.0"
