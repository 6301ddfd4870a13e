"""A request in, the page of one step of the work out; pages know nothing of each other."""
