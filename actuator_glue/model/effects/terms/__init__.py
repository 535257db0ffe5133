"""Effects written as an expression: `valve: e = e + rate*integral(e)`, in code made for them.

expression.py reads the text, instructions.py and program.py turn it into instructions with their
derivatives, native.py (operations.py, lanes.py) into code of the processor, stage.py is where the
compiled step calls that, entry.py makes the catalogue's entry.
"""
