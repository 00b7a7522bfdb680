"""Documents of an output folder as bytes: plan, certificate, closest infeasible candidate, simulation, table of
states.
"""
