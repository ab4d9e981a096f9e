"""Pictures of ants: an episode, a colony, learning made visible, or a policy sheet.

Follows a policy from a file, or trains one on the spot (a colony learns together). The ending of
--out chooses the kind of file: .gif, .webp, .mp4, .png for a single picture, and without an ending
a folder of PNG pictures.
"""

from taichi_ants.commands import run

if __name__ == "__main__":
    run("render")
