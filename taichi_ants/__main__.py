"""Run the command `taichi-ants` as `python -m taichi_ants`."""

from taichi_ants.commands import main

if __name__ == "__main__":
    main()
