"""The scaling study of the colony, or one colony of any size.

Without --ants or --resume: from 1 to 1000 ants, ways of sharing a policy and pheromones are trained
and evaluated in the paper's world and in open ones, over many seeds; tables, figures and findings
go to a folder. With --ants: one colony lives for a while; it can be saved, resumed and drawn.
"""

from taichi_ants.commands import run

if __name__ == "__main__":
    run("colony")
