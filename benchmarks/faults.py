"""Plant faults in simulated labs and see whether the verdict is green where it is wrong: `python benchmarks/faults.py -o F`.

A lab is the shipped experiment with data of its own: two specimens, each unknown drawn from its prior, curves by the finite
elements, the noise and the faults of the instruments. In each kind of lab one thing is not as the experiment takes for granted:
the ball rubs, the base is slippery, a file is of another specimen. Sound labs have no such fault.
"""

from __future__ import annotations
