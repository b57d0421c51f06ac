"""The physics of the damper, written once for floats, arrays, compiled code and tensors.

Nothing here imports a compiler or a framework: each caller brings its own numbers.
"""
