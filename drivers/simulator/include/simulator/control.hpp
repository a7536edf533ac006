#pragma once

#include <cstdint>
#include <functional>
#include <list>
#include <string>
#include <string_view>

#include "base/error.hpp"
#include "simulator/faults.hpp"
#include "simulator/unique_fd.hpp"

namespace thermbal {

/// One line of the control protocol and its answer, both without the line's end:
///
///     fault KIND[=VALUE][:TARGET] [SECONDS]   from now (in lockstep: from the next scan) on; `ok FAULT`
///     clear [KIND]                            all faults, or those of one kind; `ok N cleared`
///     list                                    `ok FAULT FAULT ...`
///     time                                    `ok SECONDS`, simulated
///
/// Anything else is answered with `error ...`, which says what is accepted.
std::string obey(std::string_view line, FaultPlan& plan, double now_s);

/// Takes lines from any number of clients of a Unix stream socket and answers each. One thread, hangs on a
/// poll loop by `fd`.
class ControlSocket {
  public:
    using Obey = std::function<std::string(std::string_view line)>;

    /// Binds `path`; a socket that is there is replaced, any other file refused (refuse_input).
    static Result<ControlSocket> open(const std::string& path, Obey obey);
    ControlSocket(ControlSocket&&) = default;
    ControlSocket& operator=(ControlSocket&&) = delete;
    ~ControlSocket();

    /// Readable: call dispatch.
    int fd() const { return ready_.get(); }
    void dispatch();

  private:
    struct Client {
        UniqueFd fd;
        std::string received;
    };

    ControlSocket() = default;
    void accept_client();
    /// False when the client has gone, or sends what is no line.
    bool serve(Client& client);

    std::string path_;
    Obey obey_;
    UniqueFd listener_;
    UniqueFd ready_;  ///< epoll over the listener and all clients
    std::list<Client> clients_;
};

}  // namespace thermbal
