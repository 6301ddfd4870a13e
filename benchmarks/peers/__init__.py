"""Other finite-element codes in the place of ours: what they compute of the same sensor."""
