"""Suites that every law and tool inherits, prensa's own and users': each says in words what is wrong with a law.

They need nothing but the law; they are run in a test (``prensa.testing.check_friction(MyLaw(mu=0.2))``) or by hand.
"""

from prensa.testing.common import LawError
from prensa.testing.damage import check_damage
from prensa.testing.friction import check_friction
from prensa.testing.materials import check_flow, check_material
from prensa.testing.tools import check_tool
from prensa.testing.wear import check_wear

__all__ = ["LawError", "check_damage", "check_flow", "check_friction", "check_material", "check_tool", "check_wear"]
