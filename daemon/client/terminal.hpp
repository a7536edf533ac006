#pragma once

#include <string_view>

#include <termios.h>

#include "base/error.hpp"
#include "watch_frame.hpp"

namespace thermbal {

/// The terminal behind standard input and output as a full screen: alternate screen, no echo, no cursor.
/// Everything is given back by the destructor. Signals arrive at signal_fd() instead of ending the program.
/// One at a time.
class Terminal {
  public:
    static Result<Terminal> open();

    FrameSize size() const;
    /// Replaces what is on the screen.
    void show(std::string_view frame) const;

    /// Readable when a key was pressed; -1 without a keyboard.
    int key_fd() const { return has_keyboard_ ? 0 : -1; }
    /// Readable when one of SIGWINCH, SIGINT, SIGTERM, SIGHUP, SIGTSTP came.
    int signal_fd() const { return signal_fd_; }
    /// The signal; 0 when there is none.
    int take_signal() const;
    /// Gives the terminal back, stops the process as Ctrl-Z means it, and takes the terminal again
    /// afterwards.
    void suspend();

    Terminal(Terminal&& other) noexcept;
    Terminal& operator=(Terminal&&) = delete;
    ~Terminal();

  private:
    explicit Terminal(int signal_fd);
    void take();
    void give_back() const;

    int signal_fd_ = -1;
    bool has_keyboard_ = false;
    termios before_{};
};

}  // namespace thermbal
