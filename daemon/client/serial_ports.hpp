#pragma once

namespace thermbal {

/// `thermbalctl ports`: the serial ports of this machine, as a configuration can name them. Returns the exit
/// status.
int run_ports(bool json);

}  // namespace thermbal
