"""Flights of written polynomials through the air: a simulated quadrotor, its controller, and what the flight comes to.

    in   Mission, its kernel, each agent's polynomials, what disturbs the flights
    out  Simulated: of every flight the tracking error, the requirements on the flown path, the room between bodies

Nothing here plans, fits or knows a backend. The default engine is numpy alone
and flies many flights at once; others are asked where they are installed.
"""
