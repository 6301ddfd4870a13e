"""Lab files taken apart in, mutants with what may be read of each out; knows nothing of how a reader works inside."""
