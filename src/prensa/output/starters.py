"""Cases to start from: examples that are copied, with their comments, into the user's folder."""

from __future__ import annotations

from pathlib import Path

from prensa.errors import PrensaError

STARTERS = {
    "ring": ("ring_compression", "ring compression, from which friction is read"),
    "upsetting": ("upsetting", "a billet upset with friction"),
    "cracks": ("upsetting_cracks", "a billet whose equator cracks in upsetting"),
    "press": ("crank_press", "a billet on a crank press: is the press strong enough?"),
    "hammer": ("hammer", "two blows of a hammer and where their energy goes"),
    "rolling": ("flat_rolling", "a strip fed into a roll gap and rolled"),
    "drawing": ("wire_drawing", "a pointed wire drawn through a conical die"),
    "dome": ("hemispherical_stretching", "a clamped sheet stretched over a hemispherical punch"),
    "v-bend": ("free_bending", "a strip bent into a V, and its springback"),
    "can": ("backward_can", "a can extruded backward, with remeshing"),
    "filling": ("die_filling", "a closed die pressed full: fill, what is missing, remeshed"),
    "window": ("forging_window", "a metal by name, its press and its damage, for maps by 'prensa window'"),
    "die-load": ("die_load", "loads on the die of an upsetting, and its wear"),
    "hertz": ("cylinder_on_block", "a cylinder pressed on an elastic block"),
    "shear-ring": ("ring_shear_factor", "ring compression with a shear factor"),
    "extrusion": ("forward_extrusion", "a rod extruded forward, with remeshing"),
    "plane-extrusion": ("plane_extrusion", "a billet pushed out through a wedge-shaped die"),
    "combined": ("combined_extrusion", "a cup and a stem under one punch, with remeshing"),
    "closed-die": ("closed_die", "the blank of a gear forged in a closed die, with flash"),
    "heading": ("heading", "the head of a bolt, upset"),
    "piercing": ("piercing", "a punch driven deep into a billet"),
    "wedge": ("wedge", "a rounded wedge pressed into a block"),
    "strip": ("strip_drawing", "a strip drawn through a wedge-shaped die"),
    "drawbead": ("drawbead", "a sheet pulled through a drawbead"),
    "cup": ("cup_drawing", "a cup drawn from a round blank under a binder"),
    "channel": ("channel_forming", "a channel drawn under a force-driven holder"),
    "curl": ("draw_bending", "a channel whose walls curl when it is released"),
    "u-bend": ("u_bending", "a strip bent between lines and arcs, and released"),
    "die-bend": ("v_bending", "a sheet bent in a V-shaped die, and released"),
    "springback": ("strip_springback", "a strip bent between four rollers, and released"),
    "hardness": ("indentation", "a ball pressed into a metal and taken away"),
    "punch": ("flat_punch", "the limit load of a flat punch"),
    "stamp": ("ring_on_disc", "a ring stamp pressed on an elastic disc"),
    "tube": ("thick_tube", "a thick tube expanded to twice its bore"),
    "tension": ("necking_bar", "a round bar pulled until it necks"),
    "arch": ("snap_through", "a shallow arch that snaps through"),
    "billet": ("square_billet", "in space: a square billet upset with friction"),
    "square-head": ("square_head", "in space: the round end of a bolt upset into a square head"),
    "bar": ("bar_rolling", "in space: a bar that a roll bites and rolls"),
    "groove": ("ball_indentation", "in space: a ball pressed in, dragged and lifted"),
    "pyramid": ("vickers", "in space: a Vickers pyramid pressed into steel"),
    "square-cup": ("square_cup", "in space: a square cup drawn from a sheet under a pushed holder"),
    "tube-bend": ("tube_bending", "in space: a thin tube bent by a grooved former, and released"),
    "hook": ("snap_hook", "in space: a snap hook that bends, snaps in and is pulled out"),
}
"""By kind: the example, and what it is."""


def starter(kind: str) -> str:
    """Text of the case of a kind.

    Raises
    ------
    PrensaError
        If the file does not come with this installation.

    """
    name = f"{STARTERS[kind][0]}.yaml"
    inside = Path(__file__).parents[1] / "examples" / name  # in a wheel
    beside = Path(__file__).parents[3] / "examples" / name  # in a checkout
    for place in (inside, beside):
        if place.is_file():
            return place.read_text(encoding="utf-8")
    raise PrensaError(f"the example {name} does not come with this installation")
