"""What there is in the plane and not in space: one table, of whose sentences all refusals are made, and a page of the guide."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

_NONE: Mapping[str, Any] = MappingProxyType({})


class NotInSpace(NamedTuple):
    """A feature: the ``part`` of a case or the command, what is ``written`` there, and the ``words`` of the refusal.

    ``example``: values for the names in braces in the words, where the page shows them.
    """

    part: str
    written: str
    words: str
    example: Mapping[str, Any] = _NONE


NOT_IN_SPACE: dict[str, NotInSpace] = {
    "remesh": NotInSpace("the problem", "remesh: auto", "'remesh' is not available in space yet; leave it out"),
    "heat": NotInSpace(
        "Python", "pr.Problem(heat=…)",
        "conduction is not available in space yet; leave it out, or compute a section in plane strain or axisymmetry",
    ),
    "body_contacts": NotInSpace(
        "Python", "pr.Problem(body_contacts=…)",
        "contact between bodies is not available in space yet; join them by 'ties', or make one of them a tool",
    ),
    "thickness": NotInSpace("the problem", "thickness: 10", "bodies in space have no thickness; leave it out"),
    "mesh": NotInSpace(
        "bodies", "mesh: {type: rectangle, …}",
        "bodies in space have a mesh of type {kinds}; {type!r} is a mesh of the plane: take it as the 'section' of an 'extruded' "
        "or a 'revolved' one", {"kinds": "'box', …", "type": "rectangle"},
    ),
    "element": NotInSpace(
        "bodies", "element: q4", "{element!r} is an element of the plane; use 'h8_fbar'", {"element": "q4"}
    ),
    "material": NotInSpace(
        "Python", "in_space = False",
        "{type!r} is a material for the plane alone; use 'j2' or 'hill', or a material of your own that has a law in space",
        {"type": "Mine"},
    ),
    "tool": NotInSpace(
        "tools", "type: circle",
        "{type!r} is a tool of the plane; in space write {{type: extruded, section: {{type: {type}, …}}, axis: [0, 0, 1]}}, or "
        "'revolved'", {"type": "circle"},
    ),
    "whole body": NotInSpace(
        "contacts", "surface: block",
        "in space contacts name the sides that a tool may touch, not the whole of {body!r}; write "
        "'contacts: [{{surface: {side}, against: {tool}}}]'", {"body": "block", "side": "block.top", "tool": "roll"},
    ),
    "no contacts": NotInSpace(
        "contacts", "left out",
        "'contacts' is missing: in space it names the sides that each tool may touch; write 'contacts: [{entries}]'",
        {"entries": "{surface: block.top, against: roll}"},
    ),
    "integration": NotInSpace(
        "contacts", "integration: gauss2", "in space contact is integrated by the rule 'nodal'; leave it out"
    ),
    "interference": NotInSpace(
        "contacts", "interference: 0.1",
        "interference is not available in space yet; draw the tool beside the body and move it to its place in the first step",
    ),
    "interference of ties": NotInSpace(
        "ties", "interference: 0.1",
        "interference is not available in space yet; leave it out, and draw the two bodies in contact without overlap; in the "
        "plane it is available",
    ),
    "shear": NotInSpace(
        "loads", "shear: 10 MPa",
        "a side in space has no direction along which a shear could act; give a 'traction' of three components",
    ),
    "moment": NotInSpace(
        "push", "m: 100", "in space a moment is about an axis: write 'mx', 'my' or 'mz'"
    ),
    "outlines": NotInSpace(
        "measures", "block.angle at …, folds, fill, pockets",
        "{measure!r} is a measure of plane outlines, and bodies in space have no outline; take positions at places",
        {"measure": "block.folds"},
    ),
    "lines of contact": NotInSpace(
        "measures", "block.top-roll.length, neutral.x",
        "{measure!r} of a contact is along a line; in space take 'area', 'max.pressure' or 'count.slip'", {"measure": "length"},
    ),
    "wear": NotInSpace(
        "output", "wear: {roll: …}",
        "'output.wear' is along outlines, which tools in space do not have: leave it out, take 'prensa die'",
    ),
    "condense": NotInSpace("numerics", "condense: true", "only bodies in the plane are condensed"),
    "die": NotInSpace(
        "prensa die", "--thickness 20, --ring …",
        "stresses of dies are of sections: leave out {options} for a map of the loads", {"options": "--thickness"},
    ),
    "loads along outlines": NotInSpace(
        "Python", "result.tool_loads('roll')",
        "loads along a tool's outline are of sections; of a tool in space take its map, 'result.tool_map'",
    ),
    "adjoint": NotInSpace(
        "Python", "pr.gradient(…)", "derivatives backwards are not available in space yet; use solve(derivatives=...)"
    ),
}  # fmt: skip


def words_of(feature: str, **given: object) -> str:
    """The sentence with which a feature is refused, with the names that it has in braces ``given``."""
    return NOT_IN_SPACE[feature].words.format(**given)
