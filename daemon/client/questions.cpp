#include "questions.hpp"

#include <cstdio>
#include <iostream>

#include <fmt/format.h>
#include <unistd.h>

#include "columns.hpp"

namespace thermbal {

bool Questions::somebody_is_there() {
    return isatty(STDIN_FILENO) == 1 && isatty(STDERR_FILENO) == 1;
}

Result<std::string> Questions::ask(const std::string& question, const std::string& otherwise,
                                   const Check& check) {
    while (true) {
        fmt::print(stderr, "{}{}: ", question, otherwise.empty() ? "" : fmt::format(" [{}]", otherwise));
        std::string answer;
        if (!std::getline(std::cin, answer)) {
            fmt::print(stderr, "\n");
            return fail(NextStep::stop, "nothing was written: the questions were not answered");
        }
        if (answer.empty()) answer = otherwise;
        const std::string complaint = check ? check(answer) : "";
        if (complaint.empty()) return answer;
        fmt::print(stderr, "  {}\n", printable(complaint));
    }
}

Result<bool> Questions::ask_yes_no(const std::string& question, bool otherwise) {
    const auto answer = ask(question + " (y/n)", otherwise ? "y" : "n", [](const std::string& text) {
        return text == "y" || text == "n" || text == "yes" || text == "no" ? "" : "accepted: y or n";
    });
    if (!answer) return std::unexpected(answer.error());
    return answer->front() == 'y';
}

}  // namespace thermbal
