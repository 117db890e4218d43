"""A quarter of a block of metal in space that a round tool is pressed into, as text of a case."""


def coining(n: str, tool: str, shape: str, friction: str, depth: float, increments: int, size: str = "[10, 5, 10]") -> str:
    """The case: ``n`` bricks of a block of a ``size``, a ``tool`` of a ``shape`` that goes in by a ``depth``."""
    return f"""\
name: coining
space: solid
bodies:
  block:
    mesh: {{type: box, size: {size}, n: {n}}}
    material: {{type: j2, E: 210e3, nu: 0.3, flow: {{type: swift, K: 600, e0: 0.01, n: 0.2}}}}
tools:
  {tool}: {{{shape}, touching: block.top, at: [0, 0, 0]}}
contacts:
  - {{surface: block.top, against: {tool}, friction: {friction}}}
fixed: {{block.bottom: y, block.left: x, block.back: z}}
steps:
  - {{name: press, move: {{{tool}: {{y: {-depth}}}}}, increments: {increments}}}
"""
