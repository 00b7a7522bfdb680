"""Verification: a certificate from plan and mission, without trust in any backend."""
