"""Published models as baselines: a double bridge, ant colony optimisation, utility pheromones."""
