#pragma once

#include <mutex>
#include <utility>
#include <vector>

#include "acquisition/wake_fd.hpp"

namespace thermbal {

/// The only thing that a line, the event loop and the compute workers share. push() from any thread; take()
/// and fd() belong to the event loop: the descriptor is readable while something lies in the box.
template <typename T>
class Mailbox {
  public:
    void push(T item) {
        {
            const std::lock_guard lock(mutex_);
            items_.push_back(std::move(item));
        }
        wake_.raise();
    }

    /// Everything that has come since the last call, oldest first.
    std::vector<T> take() {
        wake_.lower();
        std::vector<T> taken;
        const std::lock_guard lock(mutex_);
        taken.swap(items_);
        return taken;
    }

    int fd() const { return wake_.fd(); }

  private:
    std::mutex mutex_;
    std::vector<T> items_;  // guarded by mutex_
    WakeFd wake_;
};

}  // namespace thermbal
