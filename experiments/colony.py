"""The scaling study of the colony, or one colony of any size.

    python experiments/colony.py study --quick
    python experiments/colony.py live --ants 1000

`study` trains and evaluates 1 to 1000 ants in the paper's world and in open ones, over many seeds;
tables, figures and findings go to a folder. `live` lets one colony live for a while; it can be
saved, resumed and drawn.
"""

from taichi_ants.commands import run

if __name__ == "__main__":
    run("colony")
