"""What the hardware costs: RTL mapped to ASAP7 cells with Yosys, area and timing (docs/synthesis.md)."""
