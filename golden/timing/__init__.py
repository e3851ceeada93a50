"""When things happen in a whole frame: the memory, the units on it, and the traces others replay."""
