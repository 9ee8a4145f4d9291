"""The drive and the printed network as Warp kernels: many robots on a GPU, compared with the CPU's fleet."""
