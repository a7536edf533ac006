#pragma once

#include <filesystem>
#include <optional>

#include <sys/stat.h>

#include "base/error.hpp"
#include "descriptor.hpp"

namespace thermbal {

/// A listening Unix stream socket. The file goes with it if it was made here and is still the same one.
class Listener {
  public:
    static Result<Listener> open(const std::filesystem::path& path, mode_t mode);
    Listener(Listener&&) noexcept = default;
    Listener& operator=(Listener&&) = delete;
    ~Listener();

    int fd() const { return socket_.get(); }

  private:
    explicit Listener(Descriptor socket) : socket_(std::move(socket)) {}
    static Result<Listener> bind_at(const std::filesystem::path& path, mode_t mode);

    Descriptor socket_;
    std::filesystem::path path_;
    std::optional<struct stat> file_;
};

}  // namespace thermbal
