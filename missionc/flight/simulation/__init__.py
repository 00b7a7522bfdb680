"""Simulation of flights: written polynomials flown by a simulated quadrotor with its controller, and evaluated.

    in   Mission, its kernel, each agent's polynomials, the disturbances of the flights
    out  Simulated: for every flight the tracking error, the requirements on the flown path, the clearance of bodies

It does not plan or fit, and knows no backend. The default engine needs only numpy and simulates many flights at once;
other engines are used if installed.
"""
