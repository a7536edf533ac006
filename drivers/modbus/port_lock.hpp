#pragma once

#include <string>

#include "base/error.hpp"

namespace thermbal {

/// Makes a serial port ours alone, against every habit that other programs have: flock and TIOCEXCL on the
/// open descriptor, and the lock file /run/lock/LCK..NAME (FHS 5.9; where that folder may not be written, the
/// other two have to do). Released by the destructor and with the process.
class PortLock {
  public:
    PortLock() = default;
    ~PortLock();
    PortLock(const PortLock&) = delete;
    PortLock& operator=(const PortLock&) = delete;

    /// Before opening: a lock file of a living process is an error that names it.
    Result<void> take_lock_file(const std::string& device);
    /// After opening.
    Result<void> take_descriptor(const std::string& device, int fd);
    void release();

  private:
    std::string lock_file_;
};

/// " by pid 4711 (minicom)" for a process that has the device open, or nothing when it cannot be seen.
std::string other_user_of(const std::string& device);

}  // namespace thermbal
