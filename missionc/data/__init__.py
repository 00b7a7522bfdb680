"""Data that ships with the compiler: vehicle profiles and the missions that `init` begins with."""
