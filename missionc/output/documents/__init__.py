"""The documents of an output folder as bytes: plan, certificate, near miss, simulation, table of states."""
