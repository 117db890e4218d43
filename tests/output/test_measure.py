import pytest
import synthetic

from prensa.errors import PrensaError
from prensa.output.measure import measure, measures


def test_measures_are_what_the_increment_holds():
    """Every family of names returns the number it promises."""
    inc = synthetic.increment(5)
    contact, tool = inc.contacts[synthetic.CONTACT], inc.tools["cylinder"]
    assert measure(inc, "force.cylinder.y") == inc.force("cylinder").y
    assert measure(inc, "place.cylinder.y") == tool.place.y
    assert measure(inc, "area.block.top-cylinder") == measure(inc, "area") == contact.area
    assert measure(inc, "max.pressure.block.top-cylinder") == contact.pressure.max()
    assert measure(inc, "max.mises") == measure(inc, "max.mises.block") == inc.bodies["block"].mises.max()
    assert measure(inc, "energy.elastic") == inc.energy["elastic"]
    assert measure(inc, "count.stick") + measure(inc, "count.slip") + measure(inc, "count.open") == len(contact.node)
    assert measure(inc, "time") == 0.5 and measure(inc, "iterations") == 6


def test_every_listed_measure_is_a_number():
    """What `measures` lists, `measure` answers with a float."""
    inc = synthetic.increment(5)
    assert all(isinstance(measure(inc, name), float) for name in measures(inc))


def test_an_unknown_measure_is_answered_with_the_nearest():
    """A misspelt measure is refused with a suggestion."""
    with pytest.raises(PrensaError, match=r"'force\.cylnder\.y'; did you mean 'force\.cylinder\.y'"):
        measure(synthetic.increment(), "force.cylnder.y")
