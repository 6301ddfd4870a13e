"""Simulated labs with faults, for benchmarks."""
