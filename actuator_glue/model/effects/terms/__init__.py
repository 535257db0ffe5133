"""Effects written as an expression: `valve: e = e + rate*integral(e)`, run by a small machine.

expression.py reads the text, instructions.py and program.py turn it into instructions with their
derivatives, machine.py executes these 32 parameter sets at a time, stage.py is where the compiled
step asks for them, entry.py makes the catalogue's entry. Nothing is compiled for a new expression.
"""
