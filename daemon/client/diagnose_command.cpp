#include "diagnose_command.hpp"

#include <fmt/format.h>

#include "compute/threads.hpp"
#include "config/model_file.hpp"
#include "files.hpp"
#include "gap/diagnose.hpp"
#include "model_input.hpp"
#include "output.hpp"
#include "progress.hpp"
#include "report/diagnosis_json.hpp"
#include "report/gap_report.hpp"

namespace thermbal {
namespace {

Result<Diagnosis> diagnosed(const DiagnoseCommand& command) {
    const auto model = read_model(command.model);
    if (!model) return std::unexpected(model.error());
    const auto test = read_recorded_test(command.file);
    if (!test) return std::unexpected(test.error());
    std::vector<Holdout> holdouts;
    for (const std::string& file : command.holdouts) {
        auto held = read_recorded_test(file);
        if (!held) return std::unexpected(held.error());
        holdouts.push_back({file, std::move(*held)});
    }
    DiagnoseOptions options;
    options.found_on = command.file;
    Progress progress("diagnose");
    return diagnose(*model, *test, holdouts, options,
                    progress.counting(parallel_on_threads(command.threads, false)));
}

Result<void> write_results(const DiagnoseCommand& command, const Diagnosis& diagnosis) {
    if (!command.write_model.empty()) {
        const auto comment =
            fmt::format("Found by thermbalctl diagnose on {}: {}", command.file, diagnosis.reason);
        if (auto done = write_file(command.write_model, write_model(diagnosis.extended, comment)); !done)
            return done;
    }
    if (command.report.empty()) return {};
    return write_file(command.report, gap_report_html(diagnosis));
}

void print_text(const Diagnosis& diagnosis) {
    fmt::print("{}: {}\n", to_string(diagnosis.verdict), diagnosis.reason);
    fmt::print("{:<30} {:>9} {:>9}\n", "run", "before", "after");
    const auto line = [](const RunComparison& run) {
        fmt::print("{:<30} {:>7.3f} C {:>7.3f} C\n", run.name, run.before_rmse_C, run.after_rmse_C);
    };
    line(diagnosis.run);
    for (const RunComparison& run : diagnosis.holdouts) line(run);
    for (const FoundEffect& found : diagnosis.effects) {
        fmt::print("{} ({:.0f} %)\n", effect_in_words(found), 100.0 * found.probability);
        for (const Suspect& other : found.alternatives) {
            fmt::print("  or {} at {} ({:.0f} %)\n",
                       other.kind.empty() ? "something without a name" : other.kind, other.at,
                       100.0 * other.probability);
        }
    }
    for (const ResidualHeat& heat : diagnosis.residual_heat) {
        fmt::print("what is missing looks like {} at {}, {:.0f} to {:.0f} min, following {}\n",
                   heat.of_sensor ? "an error of the sensor" : "heat", heat.at, heat.from_s / 60.0,
                   heat.to_s / 60.0, heat.follows);
    }
}

}  // namespace

int run_diagnose(const DiagnoseCommand& command) {
    const auto diagnosis = diagnosed(command);
    if (!diagnosis) return report_error(diagnosis.error());
    if (const auto written = write_results(command, *diagnosis); !written)
        return report_error(written.error());
    if (command.json) {
        fmt::print("{}\n", diagnosis_to_json(*diagnosis).dump(2));
    } else {
        print_text(*diagnosis);
    }
    return 0;
}

}  // namespace thermbal
