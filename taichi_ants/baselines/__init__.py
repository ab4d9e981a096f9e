"""What is no learner: the double bridge's published model, colony optimisation, utilities."""
