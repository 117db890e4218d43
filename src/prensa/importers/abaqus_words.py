"""Keywords of Abaqus decks that say nothing about the answer, and those without counterpart that do."""

from __future__ import annotations

PASSED_OVER = {
    "PREPRINT", "END STEP", "NODE", "NSET", "ELSET", "OUTPUT", "NODE OUTPUT", "ELEMENT OUTPUT", "CONTACT OUTPUT", "NODE PRINT",
    "EL PRINT", "NODE FILE", "EL FILE", "CONTACT PRINT", "CONTACT FILE", "RESTART", "MONITOR", "FILE FORMAT", "CONTROLS",
    "CONTACT CONTROLS", "DENSITY", "PRINT", "ENERGY PRINT", "ENERGY OUTPUT", "ENERGY FILE", "SECTION CONTROLS", "END ASSEMBLY",
    "CONTACT", "SURFACE PROPERTY ASSIGNMENT", "CONTACT INITIALIZATION ASSIGNMENT", "CONTACT INITIALIZATION DATA",
    "CONTACT FORMULATION", "CONTACT CONTROLS ASSIGNMENT", "CONTACT STABILIZATION", "INTEGRATED OUTPUT", "INCREMENTATION OUTPUT",
    "MODAL OUTPUT", "DIAGNOSTICS", "TIME POINTS", "ELEMENT OPERATOR OUTPUT", "DEPVAR",
}  # fmt: skip

_BEHAVIOUR = "materials are elastic, or elastic-plastic with isotropic hardening; choose one of these in the case"
_PROCEDURE = "only *STATIC steps are; here everything is slow, so write a static step with the same motions"
_CONSTRAINT = "of constraints ties of surfaces, rigid surfaces and supports are read; take it out of the deck"
_LOADING = "of loads forces on rigid bodies and pressures on surfaces (*DSLOAD, P) are read"

REFUSED = (
    dict.fromkeys((
        "HYPERELASTIC", "HYPERFOAM", "USER MATERIAL", "CREEP", "SWELLING", "VISCOELASTIC", "VISCOUS", "RATE DEPENDENT",
        "DRUCKER PRAGER", "MODIFIED DRUCKER-PRAGER", "MOHR COULOMB", "CAP PLASTICITY", "CLAY PLASTICITY", "CAST IRON PLASTICITY",
        "POTENTIAL", "CYCLIC HARDENING", "POROUS METAL PLASTICITY", "VOID NUCLEATION", "DAMAGE INITIATION", "DAMAGE EVOLUTION",
        "SHEAR FAILURE", "TENSILE FAILURE", "CRUSHABLE FOAM", "DEFORMATION PLASTICITY", "CONCRETE", "CONCRETE DAMAGED PLASTICITY",
        "BRITTLE CRACKING", "EOS", "USER DEFINED FIELD", "HYPOELASTIC", "LOW DENSITY FOAM", "COHESIVE BEHAVIOR",
    ), _BEHAVIOUR)
    | dict.fromkeys((
        "DYNAMIC", "VISCO", "BUCKLE", "FREQUENCY", "HEAT TRANSFER", "COUPLED TEMPERATURE-DISPLACEMENT", "GEOSTATIC", "SOILS",
        "STEADY STATE DYNAMICS", "MODAL DYNAMIC", "DIRECT CYCLIC", "SUBSTRUCTURE GENERATE", "ANNEAL", "STEADY STATE TRANSPORT",
        "COUPLED THERMAL-ELECTRICAL", "MASS DIFFUSION", "IMPORT",
    ), _PROCEDURE)
    | dict.fromkeys((
        "EQUATION", "MPC", "COUPLING", "KINEMATIC COUPLING", "EMBEDDED ELEMENT", "PRE-TENSION SECTION", "SHELL TO SOLID COUPLING",
        "SPRING", "DASHPOT", "CONNECTOR SECTION", "CONTACT EXCLUSIONS", "CONTACT INTERFERENCE", "CLEARANCE", "RELEASE",
        "TRANSFORM", "INERTIA RELIEF",
    ), _CONSTRAINT)
    | dict.fromkeys((
        "DLOAD", "DSFLUX", "DFLUX", "CFLUX", "TEMPERATURE", "FIELD", "PRESSURE STRESS", "FILM", "BASE MOTION",
    ), _LOADING)
    | {
        "MODEL CHANGE": "let a step of the case move the tools away ('by'), or leave bodies by 'remove_tools: true'",
        "RIGID SURFACE": "it is the old form of *SURFACE, TYPE=SEGMENTS with *RIGID BODY",
        "CHANGE FRICTION": "write 'friction' into the step of the case",
    }
)  # fmt: skip
