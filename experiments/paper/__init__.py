"""The paper's comparison of learners: data, tables, figures, and an audit of the paper's claims."""
