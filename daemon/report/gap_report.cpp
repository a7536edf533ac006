#include "report/gap_report.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>

#include <fmt/format.h>

#include "network/effect.hpp"
#include "quantity.hpp"
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
    return quantity_in_words(p.short_name(), number.value, p.to_value(at - z90 * number.sigma),
                             p.to_value(at + z90 * number.sigma));
}

std::string as_a_sentence(std::string words) {
    if (!words.empty() && words.front() >= 'a' && words.front() <= 'z')
        words.front() = static_cast<char>(words.front() - 'a' + 'A');
    return words;
}

/// What a manager asks first: how far off, how far off now, how much of it is gone.
std::string gap_facts(const Diagnosis& diagnosis) {
    const auto fact = [](const std::string& value, const std::string& what) {
        return fmt::format("<div><b>{}</b><span>{}</span></div>", value, what);
    };
    const bool held_out = !diagnosis.holdouts.empty();
    const RunComparison& run = held_out ? diagnosis.holdouts.front() : diagnosis.run;
    const char* where = held_out ? "on a run that was never fitted" : "on this run";
    std::string html = "<div class=\"facts\">";
    html += fact(fmt::format("{:.2f} &deg;C", run.before_rmse_C),
                 fmt::format("gap of the simulation, {}", where));
    if (diagnosis.effects.empty()) return html + "</div>";
    html += fact(fmt::format("{:.2f} &deg;C", run.after_rmse_C), "gap with what was found");
    if (run.before_rmse_C > 0.0 && run.after_rmse_C < run.before_rmse_C) {
        html += fact(fmt::format("{:.0f} %", 100.0 * (1.0 - run.after_rmse_C / run.before_rmse_C)),
                     "of the gap is gone; noise never goes");
    }
    return html + "</div>";
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

/// For each look-alike the clearest experiment, or that none would tell.
std::string experiments_list(const FoundEffect& found) {
    if (found.experiments.empty()) return {};
    std::string html = "<h4>What would settle it</h4><ul>";
    for (const SeparatingExperiment* one : clearest_experiments(found)) {
        const std::string rival =
            plain_kind(one->against) + (one->against_at.empty() ? "" : ", at " + one->against_at);
        const std::string answer =
            one->separates
                ? fmt::format("{}. There {} would read {:.2f} &deg;C otherwise.",
                              escaped(std::string(in_words(one->kind))), escaped(one->channel),
                              one->difference_C)
                : "no cool-down, second speed or change of the room's temperature of this length would tell; "
                  "look at the machine.";
        html += fmt::format("<li>Against <q>{}</q>: {}</li>", escaped(rival), answer);
    }
    return html + "</ul>";
}

std::string effect_section(const FoundEffect& found) {
    std::string html = fmt::format(
        "<div class=\"card\"><h3>{}</h3><p>The gap of the fitted run is {:.3f} &deg;C without it, "
        "{:.3f} &deg;C with it. "
        "Its numbers, with their 90 % intervals:</p><ul>",
        escaped(as_a_sentence(effect_in_words(found))), found.rmse_before_C, found.rmse_after_C);
    for (const CalibratedParameter& number : found.parameters)
        html += "<li>" + escaped(number_in_words(number)) + "</li>";
    html += "</ul>" + evidence_table(found.alternatives, &found);
    return html + experiments_list(found) + "</div>";
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

std::vector<std::size_t> largest_gap_first(const RunComparison& run) {
    std::vector<std::size_t> order(run.channels.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::stable_sort(order, std::ranges::greater{}, [&](std::size_t c) {
        return run.channel_before_rmse_C(static_cast<Eigen::Index>(c));
    });
    return order;
}

std::string run_section(const RunComparison& run, const char* what, std::size_t index, Page& page) {
    const std::string table = fmt::format("run{}", index);
    page.add_table(run_table(run, table));
    std::string html = fmt::format(
        "<h2>{} <small>{}; the channel with the largest gap first</small></h2><div class=\"plots\">",
        escaped(run.name), what);
    for (const std::size_t c : largest_gap_first(run)) {
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
                                             heat.of_sensor ? "Error of sensor" : "Heat into", heat.at,
                                             heat.from_s / 60.0, heat.to_s / 60.0, heat.follows),
                        .table = name,
                        .unit = heat.of_sensor ? "°C" : "W",
                        .lines = {{"course", "course", "accent"}},
                        .bands = {{"low", "high", "accent"}}}) +
           "</div>";
}

std::string residual_heat_section(const Diagnosis& diagnosis, Page& page) {
    if (diagnosis.residual_heat.empty()) return {};
    std::string html =
        "<h2>Where and when something is missing</h2><p class=\"quiet\">Before any name: heat (or an error "
        "of a "
        "sensor) of this course at this one place would close most of the gap. The likeliest place first; "
        "the "
        "band is two standard deviations.</p><div class=\"plots\">";
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

std::vector<const SeparatingExperiment*> clearest_experiments(const FoundEffect& found) {
    std::vector<const SeparatingExperiment*> clearest;
    for (const SeparatingExperiment& one : found.experiments) {
        const bool same = !clearest.empty() && clearest.back()->against == one.against &&
                          clearest.back()->against_at == one.against_at;
        if (!same) clearest.push_back(&one);
    }
    return clearest;
}

std::string gap_report_html(const Diagnosis& diagnosis) {
    Page page("Simulation and measurement");
    const bool rest =
        diagnosis.verdict == GapVerdict::unexplained || diagnosis.verdict == GapVerdict::partly_explained;
    page.add(fmt::format("<div class=\"verdict{}\"><h1>{}</h1><p class=\"quiet\">{}</p>{}</div>",
                         rest ? " open" : "", verdict_in_words(diagnosis),
                         escaped(as_a_sentence(diagnosis.reason)), gap_facts(diagnosis)));
    page.add("<h2>The gap, run by run</h2>" + gap_table(diagnosis));
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
