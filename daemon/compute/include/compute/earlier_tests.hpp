#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/error.hpp"
#include "modes/archive.hpp"
#include "store/reader.hpp"

namespace thermbal {

/// The prior that the earlier tests of a machine give to the next one, and how many they are.
struct MachinePrior {
    std::optional<SpectrumPrior> prior;  ///< empty without earlier tests
    std::size_t tests = 0;
};

/// The newest tests of `machine` in the database's archive (of every machine with an empty name), at most
/// `most_tests`. Errors: as Reader; stop when an entry cannot be read.
Result<MachinePrior> prior_of_machine(const Reader& database, std::string_view machine,
                                      const SpectrumOptions& spectrum, std::size_t most_tests = 10);

}  // namespace thermbal
