"""Integration rules of contact surfaces, one idea a file. Whatever stands here is an ``integration`` of the case file."""
