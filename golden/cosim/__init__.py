"""The RTL under Verilator beside the golden model."""
