#pragma once

#include <filesystem>
#include <functional>
#include <stop_token>
#include <thread>

#include "base/error.hpp"

namespace thermbal {

/// Looks through the whole database for damage while the daemon measures: on a thread and a read-only
/// connection of its own, at a low priority. Never makes the writer wait; the log cannot be emptied
/// meanwhile.
class FileCheck {
  public:
    /// `done` is called on the check's thread, once: true when the file is sound, an error when that could
    /// not be found out. Not after the destructor has begun, which ends a check under way.
    FileCheck(std::filesystem::path database, std::function<void(Result<bool>)> done);

  private:
    std::jthread thread_;
};

}  // namespace thermbal
