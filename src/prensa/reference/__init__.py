"""Closed forms and semi-analytical solutions of contact and metal forming, independent of the finite-element code.

| module | solves |
|---|---|
| `hertz` | rigid cylinder or sphere on a half-space |
| `layer` | rigid cylinder on an elastic layer, smooth or bonded base: exact kernel |
| `ring_stamp` | flat ring or disc on a half-space, ring on a layer |
| `friction` | partial slip, slip hardening of one point, wedge, circular path, capstan, laws of forming |
| `upsetting` | frictionless upsetting with elasticity: cylinder, ring, plane strain; Considere |
| `forming` | limit loads, tubes, rough plates, slab method, drawing, rolling |
| `extrusion` | backward extrusion of cans: an upper bound |
| `limit_load` | limit loads in plane strain from above, by linear programming |
| `axisymmetric_load` | limit loads of bodies of revolution from above, by stream functions |
| `bending` | moment, curvature and springback of a strip |
| `free_bending` | angle of a strip bent round a punch into a die |
| `draw_bending` | pull and curl of a strip drawn over radii, drawbeads |
| `buckling` | columns: Euler's load, the elastica |
| `tables` | tabulated results of other programs and papers |

Any consistent units. Functions take and return plain numbers and numpy arrays; scipy is loaded on first use.
"""

from .axisymmetric_load import axisymmetric_bound
from .bending import Bending, bend_strip, bend_strip_perfect, bend_strip_power
from .buckling import elastica_clamped, euler_clamped
from .draw_bending import DrawBending, draw_bending
from .extrusion import can_strain, can_upper_bound
from .forming import (
    Drawing,
    Rolling,
    Slab,
    prandtl_punch,
    rough_plates_cycloid,
    rough_plates_slab,
    slab_cylinder,
    slab_strip,
    strip_rolling,
    tube_expansion,
    tube_pressure,
    wedge_drawing,
    wedge_indentation,
)
from .free_bending import FreeBending, free_bending
from .friction import (
    CattaneoMindlin,
    MuConstant,
    MuExponential,
    MuLinear,
    PartialTwist,
    SlipLaw,
    capstan,
    cattaneo_mindlin,
    circular_path_lag,
    flat_punch_stick,
    levanov,
    lubkin_torsion,
    sliding_wedge,
    slip_hardening,
    smooth_cap,
    stribeck,
    wang_osakada,
    wanheim_bay,
)
from .hertz import (
    HertzLine,
    HertzSphere,
    hertz_line,
    hertz_line_from_a,
    hertz_sphere,
    hertz_sphere_from_a,
    hertz_sphere_from_delta,
)
from .layer import LayerLine, layer_kernel, layer_kernel_defect, layer_line
from .limit_load import Wall, crossed, halved, outline, plane_strain_bound
from .ring_stamp import RingStamp, flat_punch_stiffness, ring_stamp
from .tables import (
    RingCalibration,
    cylinder_on_layer_pressure,
    cylinder_on_layer_table,
    die_deflection,
    plate_on_rigid_plane,
    ring_compression_calibration,
    ring_stamp_pressure,
)
from .upsetting import (
    Necking,
    Upsetting,
    considere,
    ring_bore_change,
    uniaxial_compression,
    upset_cylinder,
    upset_plane_strain,
    upset_plane_stress,
)

__all__ = [
    "Bending",
    "CattaneoMindlin",
    "DrawBending",
    "Drawing",
    "FreeBending",
    "HertzLine",
    "HertzSphere",
    "LayerLine",
    "MuConstant",
    "MuExponential",
    "MuLinear",
    "Necking",
    "PartialTwist",
    "RingCalibration",
    "RingStamp",
    "Rolling",
    "Slab",
    "SlipLaw",
    "Upsetting",
    "Wall",
    "axisymmetric_bound",
    "bend_strip",
    "bend_strip_perfect",
    "bend_strip_power",
    "can_strain",
    "can_upper_bound",
    "capstan",
    "cattaneo_mindlin",
    "circular_path_lag",
    "considere",
    "crossed",
    "cylinder_on_layer_pressure",
    "cylinder_on_layer_table",
    "die_deflection",
    "draw_bending",
    "elastica_clamped",
    "euler_clamped",
    "flat_punch_stick",
    "flat_punch_stiffness",
    "free_bending",
    "halved",
    "hertz_line",
    "hertz_line_from_a",
    "hertz_sphere",
    "hertz_sphere_from_a",
    "hertz_sphere_from_delta",
    "layer_kernel",
    "layer_kernel_defect",
    "layer_line",
    "levanov",
    "lubkin_torsion",
    "outline",
    "plane_strain_bound",
    "plate_on_rigid_plane",
    "prandtl_punch",
    "ring_bore_change",
    "ring_compression_calibration",
    "ring_stamp",
    "ring_stamp_pressure",
    "rough_plates_cycloid",
    "rough_plates_slab",
    "slab_cylinder",
    "slab_strip",
    "sliding_wedge",
    "slip_hardening",
    "smooth_cap",
    "stribeck",
    "strip_rolling",
    "tube_expansion",
    "tube_pressure",
    "uniaxial_compression",
    "upset_cylinder",
    "upset_plane_strain",
    "upset_plane_stress",
    "wang_osakada",
    "wanheim_bay",
    "wedge_drawing",
    "wedge_indentation",
]
