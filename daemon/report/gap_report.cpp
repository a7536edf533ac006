#include "report/gap_report.hpp"

#include <cmath>

#include <fmt/format.h>

#include "network/effect.hpp"
#include "report/html.hpp"
#include "report/page.hpp"

namespace thermbal {
namespace {

std::string plain_kind(const std::string& kind) {
    if (kind.empty()) return "something that the catalogue does not have";
    const EffectDefinition* definition = find_effect(kind);
    return definition == nullptr ? kind : definition->summary;
}

std::string verdict_in_words(const Diagnosis& diagnosis) {
    switch (diagnosis.verdict) {
        case GapVerdict::agrees:
            return "The simulation agrees with the measurement.";
        case GapVerdict::explained:
            return "The simulation lacked something; it is found, and the gap is closed to the noise.";
        case GapVerdict::partly_explained:
            return "A part of what the simulation lacked is found; something is left over that has no name "
                   "yet.";
        case GapVerdict::unexplained:
            break;
    }
    return "The simulation lacks something, and no effect of the catalogue accounts for it.";
}

std::string number_in_words(const CalibratedParameter& number) {
    constexpr double z90 = 1.645;
    const Parameter& p = number.parameter;
    const double at = p.to_coordinate(number.value);
    return fmt::format("{} {:.3g} ({:.3g} to {:.3g})", p.name.substr(p.name.rfind('.') + 1), number.value,
                       p.to_value(at - z90 * number.sigma), p.to_value(at + z90 * number.sigma));
}

std::string gap_table(const Diagnosis& diagnosis) {
    std::string html =
        R"(<div class="scroll"><table><tr><th>run</th><th class="number">gap before</th><th class="number">gap after</th></tr>)";
    const auto row = [&](const RunComparison& run, const char* what) {
        html += fmt::format(
            R"(<tr><td>{} <small>{}</small></td><td class="number">{:.3f} &deg;C</td><td class="number">{:.3f} &deg;C</td></tr>)",
            escaped(run.name), what, run.before_rmse_C, run.after_rmse_C);
    };
    row(diagnosis.run, "fitted");
    for (const RunComparison& run : diagnosis.holdouts) row(run, "never fitted");
    return html + "</table></div>";
}

std::string evidence_table(const std::vector<Suspect>& suspects, const FoundEffect* taken) {
    std::string html =
        R"(<div class="scroll"><table><tr><th>what it might be</th><th>where</th><th class="number">probability</th></tr>)";
    const auto row = [&](const std::string& kind, const std::string& at, double probability) {
        html += fmt::format(
            R"(<tr><td>{} <small>{}</small></td><td>{}</td><td class="number">{:.1f} %</td></tr>)",
            escaped(plain_kind(kind)), escaped(kind), escaped(at), 100.0 * probability);
    };
    if (taken != nullptr) row(taken->effect.kind, taken->at, taken->probability);
    for (const Suspect& suspect : suspects) row(suspect.kind, suspect.at, suspect.probability);
    return html + "</table></div>";
}

std::string effect_section(const FoundEffect& found) {
    std::string html = fmt::format(
        "<div class=\"card\"><h3>{}</h3><p>Gap {:.3f} &deg;C before, {:.3f} &deg;C after.</p><ul>",
        escaped(effect_in_words(found)), found.rmse_before_C, found.rmse_after_C);
    for (const CalibratedParameter& number : found.parameters)
        html += "<li>" + escaped(number_in_words(number)) + "</li>";
    html += "</ul>" + evidence_table(found.alternatives, &found);
    for (const SeparatingExperiment& one : found.experiments) {
        html += fmt::format("<p>To tell it from {}: {}; {} would differ by {:.2f} &deg;C.</p>",
                            escaped(plain_kind(one.against)), escaped(one.experiment), escaped(one.channel),
                            one.difference_C);
    }
    return html + "</div>";
}

/// A run's channels, measured and simulated without and with the effects.
PlotTable run_table(const RunComparison& run, const std::string& name) {
    const auto [unit, unit_s] = time_unit(run.time_s.empty() ? 0.0 : run.time_s.back());
    PlotTable table{name, unit, {}, {}};
    for (const double time_s : run.time_s) table.x.push_back(time_s / unit_s);
    const auto add = [&](const std::string& column, const Eigen::VectorXd& values) {
        table.columns.push_back({column, rounded({values.begin(), values.end()})});
    };
    for (Eigen::Index c = 0; c < run.measured_C.cols(); ++c) {
        const std::string& channel = run.channels[static_cast<std::size_t>(c)];
        const Eigen::VectorXd measured_C = run.measured_C.col(c);
        table.columns.push_back({channel, {measured_C.begin(), measured_C.end()}});
        add(channel + " before", run.before_C.col(c));
        add(channel + " after", run.after_C.col(c));
        add(channel + " residual before", measured_C - run.before_C.col(c));
        add(channel + " residual after", measured_C - run.after_C.col(c));
    }
    return thinned(std::move(table), pixels_of_a_screen);
}

std::string run_section(const RunComparison& run, const char* what, std::size_t index, Page& page) {
    const std::string table = fmt::format("run{}", index);
    page.add_table(run_table(run, table));
    std::string html =
        fmt::format("<h2>{} <small>{}</small></h2><div class=\"plots\">", escaped(run.name), what);
    for (std::size_t c = 0; c < run.channels.size(); ++c) {
        const std::string& channel = run.channels[c];
        const auto k = static_cast<Eigen::Index>(c);
        html +=
            fmt::format("<section class=\"channel\"><h3>{} <small>{:.3f} &rarr; {:.3f} &deg;C</small></h3>",
                        escaped(channel), run.channel_before_rmse_C(k), run.channel_after_rmse_C(k));
        html += page.figure({.id = fmt::format("{}-{}", table, c),
                             .title = "Measured and simulated",
                             .table = table,
                             .unit = "°C",
                             .lines = {{"measured", channel, "ink"},
                                       {"before", channel + " before", "c1", PlotLine::Stroke::dashed},
                                       {"after", channel + " after", "accent"}}});
        html += page.figure({.id = fmt::format("{}-{}-residual", table, c),
                             .title = "Measured less simulated",
                             .table = table,
                             .unit = "°C",
                             .lines = {{"before", channel + " residual before", "c1"},
                                       {"after", channel + " residual after", "accent"}},
                             .height_px = 140});
        html += "</section>";
    }
    return html + "</div>";
}

std::string residual_heat_figure(const ResidualHeat& heat, std::size_t index, Page& page) {
    const std::string name = fmt::format("heat{}", index);
    const auto [unit, unit_s] = time_unit(heat.time_s.empty() ? 0.0 : heat.time_s.back());
    PlotTable table{name, unit, {}, {{"course", {}}, {"low", {}}, {"high", {}}}};
    for (std::size_t i = 0; i < heat.time_s.size(); ++i) {
        table.x.push_back(heat.time_s[i] / unit_s);
        table.columns[0].values.push_back(heat.course[i]);
        table.columns[1].values.push_back(heat.course[i] - 2.0 * heat.sigma[i]);
        table.columns[2].values.push_back(heat.course[i] + 2.0 * heat.sigma[i]);
    }
    page.add_table(thinned(std::move(table), pixels_of_a_screen));
    return "<div class=\"card\">" +
           page.figure({.id = name,
                        .title = fmt::format("{} {}: {:.0f} to {:.0f} min, follows {}",
                                             heat.of_sensor ? "error of sensor" : "heat into", heat.at,
                                             heat.from_s / 60.0, heat.to_s / 60.0, heat.follows),
                        .table = name,
                        .unit = heat.of_sensor ? "°C" : "W",
                        .lines = {{"course", "course", "accent"},
                                  {"2 standard deviations below", "low", "muted"},
                                  {"above", "high", "muted"}},
                        .bands = {{"low", "high", "accent"}}}) +
           "</div>";
}

std::string residual_heat_section(const Diagnosis& diagnosis, Page& page) {
    if (diagnosis.residual_heat.empty()) return {};
    std::string html = "<h2>Where and when, before any name</h2><div class=\"plots\">";
    for (std::size_t i = 0; i < diagnosis.residual_heat.size(); ++i)
        html += residual_heat_figure(diagnosis.residual_heat[i], i, page);
    return html + "</div>";
}

}  // namespace

std::string effect_in_words(const FoundEffect& found) {
    std::string words = plain_kind(found.effect.kind);
    if (!found.at.empty() && found.at != "all" && found.at != "ambient") words += ", at " + found.at;
    if (found.from_s > 60.0) words += fmt::format(", since {:.0f} min", found.from_s / 60.0);
    if (!found.parameters.empty()) words += ": " + number_in_words(found.parameters.front());
    return words;
}

std::string gap_report_html(const Diagnosis& diagnosis) {
    Page page("Simulation and measurement");
    const bool rest =
        diagnosis.verdict == GapVerdict::unexplained || diagnosis.verdict == GapVerdict::partly_explained;
    page.add(fmt::format("<div class=\"verdict{}\"><h1>{}</h1><p class=\"quiet\">{}</p></div>",
                         rest ? " open" : "", verdict_in_words(diagnosis), escaped(diagnosis.reason)));
    page.add("<h2>The gap</h2>" + gap_table(diagnosis));
    if (!diagnosis.effects.empty()) page.add("<h2>What was missing</h2>");
    for (const FoundEffect& found : diagnosis.effects) page.add(effect_section(found));
    if (rest) page.add("<h2>What is left over</h2>" + evidence_table(diagnosis.suspects, nullptr));
    page.add(residual_heat_section(diagnosis, page));
    page.add(run_section(diagnosis.run, "fitted", 0, page));
    for (std::size_t i = 0; i < diagnosis.holdouts.size(); ++i)
        page.add(run_section(diagnosis.holdouts[i], "never fitted", i + 1, page));
    return page.html();
}

}  // namespace thermbal
