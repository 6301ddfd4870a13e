"""What is believed of an unknown before the data, from its form in a file to a distribution; knows no lab file and no model."""
