"""Results in, matplotlib figures in the house style out, a module for each kind of result."""
