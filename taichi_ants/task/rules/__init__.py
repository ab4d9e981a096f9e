"""The rules of the world as Taichi functions.

Every rule stands here once, as a `ti.func` that takes what it needs as arguments: no allocation,
no input or output, no knowledge of how an engine stores its data. Both engines call them.
"""
