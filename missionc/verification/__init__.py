"""Verification: plan and mission to a certificate, trusting no backend."""
