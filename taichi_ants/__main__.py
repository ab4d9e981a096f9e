"""`python -m taichi_ants` is the command `taichi-ants`."""

from taichi_ants.commands import main

if __name__ == "__main__":
    main()
