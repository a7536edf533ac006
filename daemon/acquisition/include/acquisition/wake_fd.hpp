#pragma once

namespace thermbal {

/// An eventfd: raise() from any thread makes fd() readable, lower() makes it quiet again.
class WakeFd {
  public:
    WakeFd();
    ~WakeFd();
    WakeFd(const WakeFd&) = delete;
    WakeFd& operator=(const WakeFd&) = delete;

    void raise() const;
    void lower() const;
    int fd() const { return fd_; }

  private:
    int fd_;
};

}  // namespace thermbal
