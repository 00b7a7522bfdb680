"""Programs around the compiler: language server, sweeps, closed loop, replay of written folders."""
