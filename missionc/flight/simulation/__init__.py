"""Simulation of flights: written polynomials flown by a simulated quadrotor with its controller, and judged.

    in   Mission, its kernel, each agent's polynomials, what disturbs the flights
    out  Simulated: of every flight the tracking error, the requirements on the flown path, the room between bodies

Nothing here plans, fits or knows a backend. The default engine is numpy alone
and flies many flights at once; others are asked where they are installed.
"""
