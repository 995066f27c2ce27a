"""The steps of the live path as machine code: made once, loaded by nodes without a compiler.

The interpreted step functions stay the only source. `precompile` translates them and keeps the
result in a file; `loading` maps that file into a process, which needs llvmlite and takes a tenth
of a second where a compiler takes many. Where there is no such file, all is interpreted as before,
with the same numbers, bit by bit.
"""
