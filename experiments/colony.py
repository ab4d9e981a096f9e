"""Study how colonies scale, or run one colony of any size.

python experiments/colony.py study --quick
python experiments/colony.py live --ants 1000
"""

from taichi_ants.commands import run

if __name__ == "__main__":
    run("colony")
