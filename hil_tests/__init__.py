"""Hardware in the loop: the simulated vehicle and its ESCs, bus-level tests and benchmarks."""
