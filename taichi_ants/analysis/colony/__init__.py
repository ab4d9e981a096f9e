"""The scaling study of the colony: its data, what it compares, tables and figures."""
