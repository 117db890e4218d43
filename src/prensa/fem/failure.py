"""Why the residual could not be evaluated, as values: who asks for the reason looks at the type, who prints it takes the text."""

from __future__ import annotations

from dataclasses import dataclass

from prensa.elements.element import Why


@dataclass(frozen=True)
class ElementFailed:
    """An element that could not be evaluated; ``x``, ``y``: its centre in the initial configuration."""

    element: int
    body: str
    x: float
    y: float
    why: Why

    def __str__(self) -> str:
        return f"element {self.element} of {self.body} (initially near {self.x:.4g}, {self.y:.4g}) {self.why.value}"


@dataclass(frozen=True)
class FrictionTooSoft:
    """Friction that falls faster with slip than the tangential penalty of its contact can follow."""

    contact: str

    def __str__(self) -> str:
        return f"friction of {self.contact} softens too fast for its stiffness k_T"


NotEvaluated = ElementFailed | FrictionTooSoft
