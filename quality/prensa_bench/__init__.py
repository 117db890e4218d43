"""Benchmarks of the solver as a whole: does it converge on what users may write, and are its answers right?"""
