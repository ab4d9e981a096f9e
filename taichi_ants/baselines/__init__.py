"""What is no learner: the published model of the double bridge, and ant colony optimisation."""
