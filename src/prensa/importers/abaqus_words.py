"""Keywords and parameters of Abaqus and CalculiX decks: read, without effect here, or refused, and what may be left out by name.

Blanks and case say nothing in either program: ``*SURFACEINTERACTION`` is ``*Surface Interaction``.
"""

from __future__ import annotations

import difflib

from prensa.importers.deck import FileError

MESH = frozenset(("NODE", "ELEMENT", "NSET", "ELSET", "SURFACE", "PART", "END PART", "INSTANCE", "END INSTANCE", "ASSEMBLY",
                  "END ASSEMBLY"))  # fmt: skip
# Refused rather than passed over: nodes and elements that these keywords make would be missing without a word.
GENERATING = frozenset(("NGEN", "NFILL", "NCOPY", "NMAP", "ELGEN", "ELCOPY", "INCLUDE", "SYSTEM"))

PASSED_OVER = frozenset((
    "PREPRINT", "END STEP", "NODE", "NSET", "ELSET", "PART", "END PART", "INSTANCE", "END INSTANCE", "ASSEMBLY", "END ASSEMBLY",
    "OUTPUT", "NODE OUTPUT", "ELEMENT OUTPUT", "CONTACT OUTPUT", "ENERGY OUTPUT", "INTEGRATED OUTPUT",
    "INTEGRATED OUTPUT SECTION",
    "INCREMENTATION OUTPUT", "MODAL OUTPUT", "RADIATION OUTPUT", "ELEMENT OPERATOR OUTPUT", "MATRIX OUTPUT", "SURFACE OUTPUT",
    "SURFACE OUTPUT SECTION", "NODE PRINT", "EL PRINT", "ELEMENT PRINT", "CONTACT PRINT", "ENERGY PRINT", "SECTION PRINT",
    "FACE PRINT", "PRINT", "NODE FILE", "EL FILE", "ELEMENT FILE", "CONTACT FILE", "ENERGY FILE", "SECTION FILE", "FILE FORMAT",
    "FILE OUTPUT", "FILTER", "CONTOUR INTEGRAL", "DESIGN VARIABLES", "HISTORY", "RESTART", "MONITOR", "TIME POINTS",
    "DIAGNOSTICS", "CONTROLS", "SECTION CONTROLS",
    "HOURGLASS STIFFNESS", "SOLVER CONTROLS", "SOLUTION TECHNIQUE", "CONTACT", "CONTACT CONTROLS", "CONTACT CONTROLS ASSIGNMENT",
    "CONTACT FORMULATION", "CONTACT STABILIZATION", "SURFACE PROPERTY ASSIGNMENT", "CONTACT INITIALIZATION ASSIGNMENT",
    "ORIENTATION", "DISTRIBUTION", "DISTRIBUTION TABLE", "DEPVAR", "USER OUTPUT VARIABLES", "PHYSICAL CONSTANTS",
    "WAVEFRONT MINIMIZATION",
    # what materials say of heat and fields: nothing follows from it as long as no other datum depends on them (refused)
    "USER DEFINED FIELD", "EXPANSION", "CONDUCTIVITY", "SPECIFIC HEAT", "LATENT HEAT", "INELASTIC HEAT FRACTION",
    "GAP CONDUCTANCE", "GAP HEAT GENERATION",
    # of inertia, which no static step has: it is a word of its own in a step that has
    "MASS", "ROTARY INERTIA",
))  # fmt: skip

# Of no effect in static steps; said, since whoever wrote it meant something.
WITHOUT_EFFECT = frozenset(("DAMPING", "GLOBAL DAMPING", "MASS DAMPING"))

_BEHAVIOUR = "materials are elastic, or elastic-plastic with isotropic hardening; choose one of these in the case"
_PROCEDURE = "only *STATIC steps are; here everything is slow, so write a static step with the same motions"
_CONSTRAINT = (
    "of constraints ties of surfaces, rigid bodies, supports and sides that follow a prescribed node are read; "
    "take it out of the deck"
)
_LOADING = "only forces on rigid bodies, pressures on sides (*DSLOAD, *DLOAD) and forces per volume are read"
_STRUCTURE = "only elements of the section and rigid elements are read; take the others out"

REFUSED = (
    dict.fromkeys((
        "HYPERELASTIC", "HYPERFOAM", "USER MATERIAL", "CREEP", "SWELLING", "VISCOELASTIC", "VISCOUS", "RATE DEPENDENT",
        "DRUCKER PRAGER", "DRUCKER PRAGER HARDENING", "DRUCKER PRAGER CREEP", "MODIFIED DRUCKER-PRAGER", "MOHR COULOMB",
        "MOHR COULOMB HARDENING", "CAP PLASTICITY", "CAP HARDENING", "CLAY PLASTICITY", "CLAY HARDENING", "CAST IRON PLASTICITY",
        "POROUS ELASTIC", "PERMEABILITY", "NO COMPRESSION", "NO TENSION",
        "POTENTIAL", "CYCLIC HARDENING", "POROUS METAL PLASTICITY", "VOID NUCLEATION", "DAMAGE INITIATION", "DAMAGE EVOLUTION",
        "SHEAR FAILURE", "TENSILE FAILURE", "FAIL STRESS", "FAIL STRAIN", "CRUSHABLE FOAM", "DEFORMATION PLASTICITY", "CONCRETE",
        "CONCRETE DAMAGED PLASTICITY", "BRITTLE CRACKING", "EOS", "HYPOELASTIC", "LOW DENSITY FOAM",
        "COHESIVE BEHAVIOR", "MULLINS EFFECT", "PLASTIC AXIAL", "ANNEAL TEMPERATURE", "RATIOS", "JOINT ELASTICITY",
    ), _BEHAVIOUR)
    | dict.fromkeys((
        "DYNAMIC", "VISCO", "BUCKLE", "FREQUENCY", "COMPLEX FREQUENCY", "HEAT TRANSFER", "COUPLED TEMPERATURE-DISPLACEMENT",
        "UNCOUPLED TEMPERATURE-DISPLACEMENT", "DYNAMIC TEMPERATURE-DISPLACEMENT", "GEOSTATIC", "SOILS", "STEADY STATE DYNAMICS",
        "MODAL DYNAMIC", "DIRECT CYCLIC", "SUBSTRUCTURE GENERATE", "ANNEAL", "STEADY STATE TRANSPORT", "RANDOM RESPONSE",
        "RESPONSE SPECTRUM", "COUPLED THERMAL-ELECTRICAL", "MASS DIFFUSION", "IMPORT", "GREEN", "SENSITIVITY", "ELECTROMAGNETICS",
        "CRACK PROPAGATION", "CFD",
    ), _PROCEDURE)
    | dict.fromkeys((
        "MPC", "EMBEDDED ELEMENT", "PRE-TENSION SECTION", "SHELL TO SOLID COUPLING", "DISTRIBUTING", "DISTRIBUTING COUPLING",
        "SPRING", "DASHPOT", "CONNECTOR SECTION", "CONTACT EXCLUSIONS", "CONTACT INTERFERENCE", "CLEARANCE", "RELEASE",
        "TRANSFORM", "INERTIA RELIEF", "CYCLIC SYMMETRY MODEL", "MULTIPOINT CONSTRAINT", "RETAINED NODAL DOFS",
        "NODAL THICKNESS", "GAP",
        "CONTACT INITIALIZATION DATA", "CONTACT CLEARANCE", "CONTACT CLEARANCE ASSIGNMENT", "IMPERFECTION", "FASTENER",
        "SURFACE FLAW", "DEBOND", "FRACTURE CRITERION", "ENRICHMENT", "MAP SOLUTION", "SUBMODEL", "ADAPTIVE MESH",
    ), _CONSTRAINT)
    | dict.fromkeys((
        "DSFLUX", "DFLUX", "CFLUX", "TEMPERATURE", "FIELD", "PRESSURE STRESS", "FILM", "SFILM", "RADIATE", "SRADIATE",
        "BASE MOTION",
        "FOUNDATION", "PRESSURE PENETRATION", "FLUID CAVITY", "FLUID BEHAVIOR", "CHANGE SURFACE BEHAVIOR",
    ), _LOADING)
    | dict.fromkeys((
        "FLUID SECTION", "COHESIVE SECTION", "GASKET SECTION", "USER ELEMENT", "UEL PROPERTY", "REBAR", "REBAR LAYER",
        "MATRIX INPUT",
        "SUBSTRUCTURE PROPERTY", "INITIAL STRAIN INCREASE",
    ), _STRUCTURE)
    | {
        "MODEL CHANGE": "let a step of the case move the tools away ('by'), or leave bodies by 'remove_tools: true'",
        "RIGID SURFACE": "it is the old form of *SURFACE, TYPE=SEGMENTS with *RIGID BODY",
        "CHANGE FRICTION": "write 'friction' into the step of the case",
        "PARAMETER": "write the numbers themselves into the deck",
        "CONTACT DAMPING": "contact here has no damping",
        "BULK VISCOSITY": _PROCEDURE, "FIXED MASS SCALING": _PROCEDURE, "VARIABLE MASS SCALING": _PROCEDURE,
    }
)  # fmt: skip

READ = frozenset((
    "HEADING", "ELEMENT", "MATERIAL", "ELASTIC", "PLASTIC", "DENSITY", "SOLID SECTION", "BEAM SECTION", "BEAM GENERAL SECTION",
    "SHELL SECTION", "SHELL GENERAL SECTION", "MEMBRANE SECTION", "SURFACE", "RIGID BODY", "SURFACE INTERACTION",
    "SURFACE BEHAVIOR",
    "FRICTION", "CONTACT PAIR", "CONTACT INCLUSIONS", "CONTACT PROPERTY ASSIGNMENT", "TIE", "INITIAL CONDITIONS", "EQUATION",
    "COUPLING", "KINEMATIC", "KINEMATIC COUPLING", "AMPLITUDE", "STEP", "STATIC", "BOUNDARY", "CLOAD", "DLOAD", "DSLOAD",
))  # fmt: skip

KNOWN = READ | PASSED_OVER | WITHOUT_EFFECT | frozenset(REFUSED) | MESH | GENERATING

LEFT_OUT: dict[str, tuple[str, frozenset[str]]] = {
    "adjust": (
        "nodes that are moved onto the master surface at the start",
        frozenset(("CONTACT INITIALIZATION DATA",)),
    ),
    "damage": (
        "damage and failure of materials",
        frozenset(("DAMAGE INITIATION", "DAMAGE EVOLUTION", "SHEAR FAILURE", "TENSILE FAILURE", "FAIL STRESS", "FAIL STRAIN")),
    ),
    "inertia": (
        "dynamic steps become static ones of the same duration",
        frozenset(("DYNAMIC", "BULK VISCOSITY", "FIXED MASS SCALING", "VARIABLE MASS SCALING")),
    ),
    "rate": (
        "creep, swelling and viscosity; *VISCO steps become static ones",
        frozenset(("CREEP", "SWELLING", "VISCOELASTIC", "VISCOUS", "RATE DEPENDENT", "VISCO", "CONTACT DAMPING")),
    ),
    "small-sliding": ("contact that keeps its first place on the master surface", frozenset()),
    "softened-contact": ("pressures over overlap that are not a straight line; contact is hard then", frozenset()),
    "temperature": (
        "temperatures, heat and thermal strains; coupled steps become static ones",
        frozenset(("TEMPERATURE", "COUPLED TEMPERATURE-DISPLACEMENT", "UNCOUPLED TEMPERATURE-DISPLACEMENT", "CFLUX", "DFLUX",
                   "DSFLUX", "FILM", "SFILM", "RADIATE", "SRADIATE")),
    ),
    "volume-law": ("the volumetric energy of *HYPERELASTIC, NEO HOOKE: 'neo_hooke' has its own instead", frozenset()),
}  # fmt: skip
"""What a user may leave out: name → (what it is, keywords that fall away with it)."""

AS_STATIC = frozenset(
    ("DYNAMIC", "VISCO", "COUPLED TEMPERATURE-DISPLACEMENT", "UNCOUPLED TEMPERATURE-DISPLACEMENT")
)
"""Procedures that are read as static ones where what makes them different is left out."""

_NAMES = {"NAME"}
PARAMETERS_OF: dict[str, set[str]] = {
    "NODE": {"NSET", "SYSTEM"}, "ELEMENT": {"TYPE", "ELSET"},
    "NSET": {"NSET", "ELSET", "GENERATE", "INSTANCE", "INTERNAL", "UNSORTED"},
    "ELSET": {"ELSET", "GENERATE", "INSTANCE", "INTERNAL", "UNSORTED"},
    "SURFACE": {"NAME", "TYPE", "FILLET RADIUS", "COMBINE", "CROP", "INTERNAL", "REGION TYPE", "TRIM", "DEFINITION", "MAX RATIO",
                "NO OFFSET", "NO THICK", "SCALE THICK", "PROPERTY"},
    "PART": _NAMES, "ASSEMBLY": _NAMES, "INSTANCE": {"NAME", "PART"},
    "MATERIAL": {"NAME", "RTOL", "SRATE FACTOR", "STRAIN RATE REGULARIZATION"},
    "ELASTIC": {"TYPE", "MODULI", "DEPENDENCIES"}, "PLASTIC": {"HARDENING", "DATA TYPE", "RATE", "DEPENDENCIES"},
    "DENSITY": set(), "HYPERELASTIC": {"NEO HOOKE", "MODULI"},
    "SOLID SECTION": {"ELSET", "MATERIAL", "CONTROLS", "ORIENTATION", "OFFSET", "STACK DIRECTION"},
    "RIGID BODY": {"REF NODE", "ROT NODE", "ELSET", "NSET", "ANALYTICAL SURFACE", "TIE NSET", "PIN NSET", "POSITION",
                   "ISOTHERMAL"},
    "SURFACE INTERACTION": {"NAME"},
    "SURFACE BEHAVIOR": {"PRESSURE-OVERCLOSURE", "NO SEPARATION", "AUGMENTED LAGRANGE", "PENALTY", "DIRECT"},
    "FRICTION": {"SLIP TOLERANCE", "ELASTIC SLIP", "LAGRANGE", "TAUMAX", "ROUGH", "DEPENDENCIES", "EXPONENTIAL DECAY", "USER"},
    "CONTACT PAIR": {"INTERACTION", "TYPE", "ADJUST", "SMALL SLIDING", "TIED", "CPSET", "MECHANICAL CONSTRAINT", "WEIGHT",
                     "TRACKING", "EXTENSION ZONE", "SMOOTH", "NO THICKNESS", "SUPPLEMENTARY CONSTRAINTS", "MINIMUM DISTANCE",
                     "OP", "HCRIT", "SLIDING TRANSITION"},
    "CONTACT INCLUSIONS": {"ALL EXTERIOR", "ALL ELEMENT BASED"}, "CONTACT PROPERTY ASSIGNMENT": set(),
    "TIE": {"NAME", "ADJUST", "POSITION TOLERANCE", "TYPE", "NO ROTATION", "NO THICKNESS", "CONSTRAINT RATIO"},
    "INITIAL CONDITIONS": {"TYPE"}, "EQUATION": set(), "COUPLING": {"CONSTRAINT NAME", "REF NODE", "SURFACE", "INFLUENCE RADIUS"},
    "KINEMATIC": set(), "KINEMATIC COUPLING": {"REF NODE"},
    "AMPLITUDE": {"NAME", "DEFINITION", "TIME", "VALUE", "SMOOTH"},
    "STEP": {"NAME", "NLGEOM", "INC", "UNSYMM", "EXTRAPOLATION", "CONVERT SDI", "SOLVER", "AMPLITUDE", "PERTURBATION"},
    "STATIC": {"DIRECT", "STABILIZE", "ALLSDTOL", "CONTINUE", "RIKS", "SOLVER", "LONG TERM"},
    "BOUNDARY": {"OP", "AMPLITUDE", "TYPE", "FIXED", "LOAD CASE", "REGION TYPE"},
    "CLOAD": {"OP", "AMPLITUDE", "LOAD CASE", "REGION TYPE"}, "DLOAD": {"OP", "AMPLITUDE", "LOAD CASE", "REGION TYPE"},
    "DSLOAD": {"OP", "AMPLITUDE", "FOLLOWER", "LOAD CASE", "REGION TYPE"},
}  # fmt: skip
"""Parameters of the keywords that are read: those read themselves and those without effect here. Others are refused."""


def squeezed(name: str) -> str:
    """A name in capitals without blanks, as both programs compare it."""
    return "".join(name.split()).upper()


_SPELLED = {squeezed(name): name for name in KNOWN}
_PARAMETERS = {squeezed(name): name for names in PARAMETERS_OF.values() for name in names}


def keyword(name: str) -> str:
    """A keyword as it is spelled in the manuals; an unknown one in capitals with single blanks."""
    return _SPELLED.get(squeezed(name), " ".join(name.split()).upper())


def parameter(name: str) -> str:
    """The same of a parameter."""
    return _PARAMETERS.get(squeezed(name), " ".join(name.split()).upper())


def nearest(name: str, known: frozenset[str] | set[str]) -> str | None:
    """The known name that an unknown one is likely to be a slip of."""
    near = difflib.get_close_matches(squeezed(name), [squeezed(k) for k in sorted(known)], n=1)
    return _SPELLED.get(near[0], _PARAMETERS.get(near[0])) if near else None


def refuse_unknown_parameters(name: str, parameters: dict[str, str], line: int) -> None:
    """Refuse what a keyword that is read says in words that are not.

    Raises
    ------
    FileError
        With the line and the nearest parameter.

    """
    if name in PARAMETERS_OF and (unknown := [p for p in parameters if p and p not in PARAMETERS_OF[name]]):
        near = nearest(unknown[0], PARAMETERS_OF[name])
        read = ", ".join(sorted(PARAMETERS_OF[name]))
        hint = f"did you mean {near}?" if near else f"{read and f'{read} are; '}take it out if the answer does not depend on it"
        raise FileError.at(line, f"{unknown[0]} of *{name} is not read; {hint}")


def may_be_left_out() -> str:
    """The list of what ``--without`` takes, for messages."""
    return ", ".join(LEFT_OUT)


def group_of(name: str) -> str | None:
    """The word under which a keyword may be left out."""
    return next((group for group, (_, names) in LEFT_OUT.items() if name in names), None)
