"""A mistake among the names of a description, and the known name that was likely meant."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from dataclasses import dataclass

SYMMETRY = "symmetry"  # in ``no_contact``: the lines of symmetry and the axis
FIELD_WORDS = {
    "angle": "rz", "rotation": "rz", "rot": "rz", "turn": "rz", "phi": "rz", "theta": "rz",
    "rz": "m", "moment": "m", "torque": "m", "m": "rz",
    "young": "E", "youngs_modulus": "E", "elastic_modulus": "E", "modulus": "E",
    "poisson": "nu", "poissons_ratio": "nu", "poisson_ratio": "nu",
    "friction_coefficient": "mu", "coefficient": "mu", "cof": "mu",
    "shear_factor": "shear", "friction_factor": "m", "tresca": "shear",
    "plastic": "j2", "plasticity": "j2", "elastoplastic": "j2", "elastic_plastic": "j2", "mises": "j2", "von_mises": "j2",
    "hardening": "flow", "flow_curve": "flow", "flow_stress": "flow",
    "yield_stress": "s0", "yield": "s0", "sigma_y": "s0", "sigma0": "s0",
    "roller": "circle", "roll": "circle", "cylinder": "circle", "wall": "plane", "plate": "plane", "line": "plane",
    "polyline": "profile", "dxf": "profile", "drawing": "profile",
    "displacement": "move", "travel": "move", "stroke": "move", "force": "push",
    "time": "duration", "total_time": "duration", "period": "duration",
    "supports": "fixed", "support": "fixed", "boundary": "fixed", "boundary_conditions": "fixed", "constraints": "fixed",
    "3d": "solid", "three_dimensional": "solid",
    "axi": "axisymmetric", "axisymmetry": "axisymmetric", "rotational": "axisymmetric",
    "parts": "bodies", "workpiece": "bodies", "workpieces": "bodies", "blank": "bodies",
    "interactions": "contacts", "pairs": "contacts", "dies": "tools", "rigid_bodies": "tools",
}  # fmt: skip
"""Words of the trade and of other programs, and the name that stands for each in a description."""

ELSEWHERE = {
    "temperature": "a flow curve that depends on it takes it as 'T'; heat is not computed from files",
    "density": "inertia is neglected; a weight is 'body_force', a force per volume",
    "gravity": "a weight is 'body_force', a force per volume",
    "dt": "give 'increments', their number, or leave it out: it is found on the way",
}
"""Words of the trade that stand for no name of a description, and what there is instead."""
_SAME = {"temp": "temperature", "rho": "density", "g": "gravity", "time_step": "dt", "timestep": "dt", "time_increment": "dt"}


def elsewhere(word: str) -> str:
    """What there is instead of what a word of the trade stands for; '' of others."""
    word = word.casefold().replace(" ", "_")
    return ELSEWHERE.get(_SAME.get(word, word), "")


def of_the_trade(word: str) -> str | None:
    """The name in a description that a word of the trade or of another program stands for, if one does."""
    return FIELD_WORDS.get(word.casefold().replace(" ", "_").replace("'", ""))


def nearest(name: str, known: Iterable[str]) -> str | None:
    """The known name that is spelt most like a name, if one is near; letters may differ in case."""
    known = list(known)
    same = [k for k in known if k.casefold() == name.casefold()]
    return next(iter(same or difflib.get_close_matches(name, known, n=1)), None)


def meant(name: str, known: Iterable[str]) -> str | None:
    """The known name that was likely meant: the one that a word of the trade stands for, or the `nearest`."""
    known = list(known)
    here = of_the_trade(name)
    return here if here in known else nearest(name, known)


def of_a_slip(name: str, known: Iterable[str]) -> str | None:
    """What to write where YAML has made a key of something else: a colon without a blank, the rest of a decimal comma."""
    key, colon, value = name.partition(":")
    if colon and key in known:
        return f"; a blank is missing after the colon: write '{key}: {value.strip()}'"
    if name[:1].isdigit():
        return "; numbers have a decimal point, and a comma parts two entries"
    if blank := next((c for c in (name[:1], name[-1:]) if c.isspace() and c != " "), ""):
        return f"; it begins or ends with a blank of web pages (U+{ord(blank):04X}): replace that with a space"
    return None


def suggest_key(name: str, known: Iterable[str]) -> str:
    """What to write for a key that is not known: see `of_a_slip` and `suggest`."""
    known = list(known)
    return of_a_slip(name, known) or suggest(name, known)


def suggest(name: str, known: Iterable[str]) -> str:
    """'; did you mean …?' for the name that was likely `meant`, with the known ones unless it is near, or these alone."""
    known = list(known)
    near = nearest(name, known)
    if near is not None and meant(name, known) == near:
        return f"; did you mean {near!r}?"
    listed = f"known: {', '.join(map(repr, known))}"
    if (here := meant(name, known)) is not None:
        return f"; did you mean {here!r}? {listed}"
    return f"; {listed}" if known else "; none is defined"


@dataclass(frozen=True)
class Finding:
    """A mistake among the cross-references: ``path`` into the description (keys and indices), and the message.

    ``at_key``: the key at the end of the path is wrong, not what stands behind it.
    """

    path: tuple[str | int, ...]
    message: str
    at_key: bool = False

    def __str__(self) -> str:
        return f"{'.'.join(map(str, self.path))}: {self.message}"
