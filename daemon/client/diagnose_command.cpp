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

/// What is to be diagnosed.
struct Subject {
    std::string name;
    RecordedTest test;
    Model model;
};

Result<Model> model_of(const DiagnoseCommand& command, const StoredTest& test) {
    if (!command.model.empty()) return read_model(command.model);
    if (test.record.model_toml.empty()) {
        return fail(NextStep::refuse_input,
                    fmt::format("test {} was compared with no model; name one with --model", test.id));
    }
    return load_model(test.record.model_toml,
                      fmt::format("test {}, stored from {}", test.id, test.record.model_file));
}

Result<Subject> stored_subject(const DiagnoseCommand& command) {
    const auto reader = open_database(command.database);
    if (!reader) return std::unexpected(reader.error());
    const auto test = reader->test(*command.test);
    if (!test) return std::unexpected(test.error());
    auto model = model_of(command, *test);
    if (!model) return std::unexpected(model.error());
    auto recorded = reader->recorded_test(test->id);
    if (!recorded) return std::unexpected(recorded.error());
    return Subject{fmt::format("test {} of {}", test->id, reader->path().string()), std::move(*recorded),
                   std::move(*model)};
}

Result<Subject> recorded_subject(const DiagnoseCommand& command) {
    auto model = read_model(command.model);
    if (!model) return std::unexpected(model.error());
    auto test = read_recorded_test(command.file);
    if (!test) return std::unexpected(test.error());
    return Subject{command.file, std::move(*test), std::move(*model)};
}

Result<Diagnosis> diagnosed(const DiagnoseCommand& command) {
    const auto subject = command.test ? stored_subject(command) : recorded_subject(command);
    if (!subject) return std::unexpected(subject.error());
    std::vector<Holdout> holdouts;
    for (const std::string& file : command.holdouts) {
        auto held = read_recorded_test(file);
        if (!held) return std::unexpected(held.error());
        holdouts.push_back({file, std::move(*held)});
    }
    DiagnoseOptions options;
    options.found_on = subject->name;
    const Progress progress("diagnose");
    return diagnose(subject->model, subject->test, holdouts, options,
                    parallel_on_threads(command.threads, false));
}

Result<void> write_results(const DiagnoseCommand& command, const Diagnosis& diagnosis) {
    if (!command.write_model.empty()) {
        const auto comment =
            fmt::format("Found by thermbalctl diagnose on {}: {}", diagnosis.run.name, diagnosis.reason);
        if (auto done = write_file(command.write_model, write_model(diagnosis.extended, comment)); !done)
            return done;
    }
    if (command.report.empty()) return {};
    return write_file(command.report, gap_report_html(diagnosis));
}

std::string as_text(const Diagnosis& diagnosis) {
    std::string text = fmt::format("{}: {}\n", to_string(diagnosis.verdict), diagnosis.reason);
    text += fmt::format("{:<30} {:>9} {:>9}\n", "run", "before", "after");
    const auto line = [&text](const RunComparison& run) {
        text += fmt::format("{:<30} {:>7.3f} C {:>7.3f} C\n", run.name, run.before_rmse_C, run.after_rmse_C);
    };
    line(diagnosis.run);
    for (const RunComparison& run : diagnosis.holdouts) line(run);
    for (const FoundEffect& found : diagnosis.effects) {
        text += fmt::format("{} ({:.0f} %)\n", effect_in_words(found), 100.0 * found.probability);
        for (const Suspect& other : found.alternatives) {
            text += fmt::format("  or {} at {} ({:.0f} %)\n",
                                other.kind.empty() ? "something without a name" : other.kind, other.at,
                                100.0 * other.probability);
        }
        for (const SeparatingExperiment* one : clearest_experiments(found)) {
            if (one->separates)
                text +=
                    fmt::format("  to tell it from {} at {}: {}; {} would differ by {:.2f} C\n", one->against,
                                one->against_at, in_words(one->kind), one->channel, one->difference_C);
        }
    }
    for (const ResidualHeat& heat : diagnosis.residual_heat) {
        text += fmt::format("what is missing looks like {} at {}, {:.0f} to {:.0f} min, following {}\n",
                            heat.of_sensor ? "an error of the sensor" : "heat", heat.at, heat.from_s / 60.0,
                            heat.to_s / 60.0, heat.follows);
    }
    return text;
}

}  // namespace

int run_diagnose(const DiagnoseCommand& command) {
    const auto diagnosis = diagnosed(command);
    if (!diagnosis) return report_error(diagnosis.error());
    if (const auto written = write_results(command, *diagnosis); !written)
        return report_error(written.error());
    return command.json ? print_json(diagnosis_to_json(*diagnosis)) : print_text(as_text(*diagnosis));
}

}  // namespace thermbal
