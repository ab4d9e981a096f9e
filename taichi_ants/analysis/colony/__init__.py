"""The scaling study of the colony: data, comparisons, tables and figures."""
