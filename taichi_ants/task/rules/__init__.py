"""The rules of the world as Taichi functions, which both engines call.

Each rule is one `ti.func`. It gets everything that it needs as arguments, because engines store
their data differently. It does not allocate memory or write into arrays.
"""
