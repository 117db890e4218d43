"""Gauss points of each edge, and Kikuchi's reading of them."""

from __future__ import annotations

from typing import ClassVar, Literal

import numpy as np

from prensa.contact.integration import Candidates, Points, Shares
from prensa.contact.rule import IntegrationRule


class _Gauss(IntegrationRule, abstract=True):
    """Points at places ξ on (0, 1) of each edge, with factors of its length."""

    place: ClassVar[tuple[float, ...]]
    factor: ClassVar[tuple[float, ...]]

    def points(self, surface: Candidates) -> Points:
        """The points inside each edge."""
        m, q = len(surface.edges), len(self.place)
        xi, edge = np.tile(self.place, m), np.repeat(np.arange(m), q)
        shares = Shares(np.arange(m * q), edge, np.tile(self.factor, m), xi, xi)
        return surface.all_of(surface.edges[edge], np.stack([1 - xi, xi], axis=1), surface.depth[edge], shares)


class Gauss1(_Gauss):
    """The middle of each edge."""

    type: Literal["gauss1"] = "gauss1"
    determined: ClassVar[bool] = True
    place: ClassVar[tuple[float, ...]] = (0.5,)
    factor: ClassVar[tuple[float, ...]] = (1.0,)


class Gauss2(_Gauss):
    """Two points an edge."""

    type: Literal["gauss2"] = "gauss2"
    place: ClassVar[tuple[float, ...]] = (0.5 - 0.5 / 3**0.5, 0.5 + 0.5 / 3**0.5)
    factor: ClassVar[tuple[float, ...]] = (0.5, 0.5)


class Gauss3(_Gauss):
    """Three points an edge."""

    type: Literal["gauss3"] = "gauss3"
    place: ClassVar[tuple[float, ...]] = (0.5 - 0.5 * 0.6**0.5, 0.5, 0.5 + 0.5 * 0.6**0.5)
    factor: ClassVar[tuple[float, ...]] = (5 / 18, 8 / 18, 5 / 18)


class Kikuchi(_Gauss):
    """The points of ``gauss2``, whose pressures are then projected to the nodes with the trapezoid-lumped mass.

    Our reading of Kikuchi (1982, Int. J. Numer. Methods Eng. 18, 343-350).
    """

    type: Literal["kikuchi"] = "kikuchi"
    projected: ClassVar[bool] = True
    place: ClassVar[tuple[float, ...]] = Gauss2.place
    factor: ClassVar[tuple[float, ...]] = Gauss2.factor
