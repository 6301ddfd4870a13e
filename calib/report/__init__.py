"""Results in, pages, figures, tables and summaries for people and programs out; computes no result."""
