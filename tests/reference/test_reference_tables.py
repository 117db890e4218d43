"""Tables that ship with the package, and the package itself."""

import subprocess
import sys

import numpy as np
import pytest

import prensa.reference as reference
from prensa.reference.tables import EXAMPLE1_DELTA, EXAMPLE1_FORCE_REFERENCE_GEOMETRY, PLATE_UX_CONVERGED


def test_import_is_light():
    """Importing prensa.reference loads no scipy module beyond those the package itself has loaded."""
    code = "import sys, prensa; a = {m for m in sys.modules if m.startswith('scipy')}; import prensa.reference;"
    code += "print(len({m for m in sys.modules if m.startswith('scipy')} - a))"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "0"


def test_public_names_exist_and_are_documented():
    """Every exported function and class has a docstring, and every exported function names its source."""
    for name in reference.__all__:
        thing = getattr(reference, name)
        if name == "SlipLaw":
            continue
        assert thing.__doc__, name
        if not isinstance(thing, type):
            assert "Source: " in thing.__doc__, name


def test_layer_tables():
    """The layer tables have their rows, agree with each other, and lie above the block of finite width."""
    table = reference.cylinder_on_layer_table()
    assert all(column.shape == (15,) for column in table.values())
    for delta in (0.1, 0.5, 1.0, 2.0):
        profile = reference.cylinder_on_layer_pressure(delta)
        row = np.argmin(np.abs(table["delta"] - delta))
        assert profile["p"].shape == (41,)
        assert profile["p"][0] == table["p0"][row]
    for delta, force in zip(EXAMPLE1_DELTA, EXAMPLE1_FORCE_REFERENCE_GEOMETRY):
        assert force < table["P"][np.argmin(np.abs(table["delta"] - delta))] < 1.003 * force


def test_ring_stamp_table():
    """The ring tables span the ring, and their two pressure columns have one ratio, the mean pressure."""
    for support in ("halfspace", "layer_smooth_base"):
        table = reference.ring_stamp_pressure(support)
        assert table["r"].shape == (80,)
        assert np.all((table["r"] > 8.0) & (table["r"] < 12.0))
        assert np.ptp(table["p"] / table["p_over_mean"]) < 1e-5 * table["p"].min()


def test_plate_table():
    """The plate table obeys Coulomb with mu = 1 and contains the converged displacements."""
    table = reference.plate_on_rigid_plane()
    assert table["x"] == pytest.approx(0.3125 * np.arange(128))
    assert np.all(np.abs(table["tau"]) <= table["p"] * (1.0 + 1e-9) + 1e-9)
    for x, ux in PLATE_UX_CONVERGED.items():
        assert 1e3 * np.interp(x, table["x"], table["ux"]) == pytest.approx(ux, abs=0.01)


def test_ring_calibration():
    """The calibration has 18 curves at six reductions, ordered: more friction, smaller bore."""
    table = reference.ring_compression_calibration()
    assert table.reduction == pytest.approx([0.1, 0.2, 0.3, 0.4, 0.5, 0.6])
    assert table.change.shape == (18, 6)
    for law in ("mu", "m"):
        curves = np.array([table.curve(name) for name in table.friction if name.split("=")[0] == law])
        assert np.all(np.diff(curves, axis=0) <= 0.0)


@pytest.mark.parametrize(
    ("name", "call"),
    [
        ("delta", lambda: reference.cylinder_on_layer_pressure(0.3)),
        ("support", lambda: reference.ring_stamp_pressure("disc")),
        ("friction", lambda: reference.ring_compression_calibration().curve("mu=0.11")),
    ],
)
def test_errors_name_the_argument(name, call):
    """A table that does not exist is refused by name."""
    with pytest.raises(ValueError, match=f"^{name} = "):
        call()
