"""The paper's comparison of learners: its data, tables and figures, and the audit of its claims."""
