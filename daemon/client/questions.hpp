#pragma once

#include <functional>
#include <string>

#include "base/error.hpp"

namespace thermbal {

/// Asks a person at the terminal: questions on standard error, answers from standard input.
class Questions {
  public:
    /// Whether there is somebody to ask.
    static bool somebody_is_there();

    /// What is wrong with an answer; empty when it is accepted.
    using Check = std::function<std::string(const std::string& answer)>;

    /// Asks until the answer is accepted; Enter alone means `otherwise`. Error (stop): the input ended.
    static Result<std::string> ask(const std::string& question, const std::string& otherwise,
                                   const Check& check = nullptr);
    static Result<bool> ask_yes_no(const std::string& question, bool otherwise);
};

}  // namespace thermbal
