#pragma once

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <initializer_list>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

namespace thermbal::testing {

using Numbers = std::vector<double>;

/// Runs a Python script of the tests with a file of requests, one line each, and returns its answers, one
/// line of numbers each. The script is the independent party: it computes with a library that is not ours.
inline std::vector<Numbers> ask_python(const std::string& script, const std::string& requests) {
    std::string path = ::testing::TempDir() + "thermbal_peer_XXXXXX";
    const int descriptor = mkstemp(path.data());
    EXPECT_GE(descriptor, 0) << path;
    if (descriptor >= 0) close(descriptor);
    std::ofstream(path) << requests;
    const std::string command =
        std::string(THERMBAL_PYTHON) + " -B " + THERMBAL_SOURCE_DIR + "/tests/" + script + " " + path;
    FILE* pipe = popen(command.c_str(), "r");
    std::string output;
    char buffer[65536];
    while (pipe != nullptr && !feof(pipe)) {
        const std::size_t count = fread(buffer, 1, sizeof buffer, pipe);
        output.append(buffer, count);
    }
    const int status = pipe == nullptr ? -1 : pclose(pipe);
    EXPECT_EQ(status, 0) << command;
    std::remove(path.c_str());

    std::vector<Numbers> answers;
    std::istringstream lines(output);
    for (std::string line; std::getline(lines, line);) {
        std::istringstream words(line);
        Numbers numbers;
        for (std::string word; words >> word;) numbers.push_back(std::strtod(word.c_str(), nullptr));
        answers.push_back(std::move(numbers));
    }
    return answers;
}

/// Numbers as words that read back to the same doubles.
inline std::string to_words(const Numbers& numbers) {
    std::string words;
    char word[64];
    for (const double number : numbers) {
        std::snprintf(word, sizeof word, " %.17g", number);
        words += word;
    }
    return words;
}

}  // namespace thermbal::testing
