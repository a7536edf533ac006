#include "compute/earlier_tests.hpp"

#include <cstdint>

#include "report/spectrum_json.hpp"

namespace thermbal {

Result<MachinePrior> prior_of_machine(const Reader& database, std::string_view machine,
                                      const SpectrumOptions& spectrum, std::size_t most_tests) {
    const auto records = database.archive(machine, static_cast<std::int64_t>(most_tests));
    if (!records) return std::unexpected(records.error());
    std::vector<ArchivedSpectrum> tests;
    for (const ArchiveRecord& record : *records) {
        auto read = spectrum_from_json(nlohmann::json::parse(record.spectrum_json, nullptr, false));
        if (!read) return std::unexpected(read.error());
        tests.push_back(std::move(*read));
    }
    if (tests.empty()) return MachinePrior{};
    auto prior = learn_prior(tests, spectrum, ArchiveOptions{});
    if (!prior) return std::unexpected(prior.error());
    return MachinePrior{std::move(*prior), tests.size()};
}

}  // namespace thermbal
