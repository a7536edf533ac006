#include "report/gap_report.hpp"

#include <cmath>
#include <map>

#include <fmt/format.h>

#include "network/effect.hpp"
#include "svg_plot.hpp"

namespace thermbal {
namespace {

constexpr char measured_colour[] = "#444", before_colour[] = "#c0392b", after_colour[] = "#1f77b4";

std::string escaped(std::string_view text) {
    std::string result;
    for (const char c : text) {
        switch (c) {
            case '<':
                result += "&lt;";
                break;
            case '>':
                result += "&gt;";
                break;
            case '&':
                result += "&amp;";
                break;
            case '"':
                result += "&quot;";
                break;
            default:
                result += c;
        }
    }
    return result;
}

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
    std::string html = "<table><tr><th>run</th><th>gap before</th><th>gap after</th></tr>";
    const auto row = [&](const RunComparison& run, const char* what) {
        html += fmt::format("<tr><td>{} ({})</td><td>{:.3f} &deg;C</td><td>{:.3f} &deg;C</td></tr>",
                            escaped(run.name), what, run.before_rmse_C, run.after_rmse_C);
    };
    row(diagnosis.run, "fitted");
    for (const RunComparison& run : diagnosis.holdouts) row(run, "never fitted");
    return html + "</table>";
}

std::string evidence_table(const std::vector<Suspect>& suspects, const FoundEffect* taken) {
    std::string html = "<table><tr><th>what it might be</th><th>where</th><th>probability</th></tr>";
    const auto row = [&](const std::string& kind, const std::string& at, double probability) {
        html += fmt::format(R"(<tr><td>{} <small>{}</small></td><td>{}</td><td>{:.1f} %</td></tr>)",
                            escaped(plain_kind(kind)), escaped(kind), escaped(at), 100.0 * probability);
    };
    if (taken != nullptr) row(taken->effect.kind, taken->at, taken->probability);
    for (const Suspect& suspect : suspects) row(suspect.kind, suspect.at, suspect.probability);
    return html + "</table>";
}

std::string effect_section(const FoundEffect& found) {
    std::string html = fmt::format("<h3>{}</h3><p>Gap {:.3f} &deg;C before, {:.3f} &deg;C after.</p><ul>",
                                   escaped(effect_in_words(found)), found.rmse_before_C, found.rmse_after_C);
    for (const CalibratedParameter& number : found.parameters)
        html += "<li>" + escaped(number_in_words(number)) + "</li>";
    html += "</ul>" + evidence_table(found.alternatives, &found);
    for (const SeparatingExperiment& one : found.experiments) {
        html += fmt::format("<p>To tell it from {}: {}; {} would differ by {:.2f} &deg;C.</p>",
                            escaped(plain_kind(one.against)), escaped(one.experiment), escaped(one.channel),
                            one.difference_C);
    }
    return html;
}

std::string channel_plots(const RunComparison& run, Eigen::Index channel) {
    const Eigen::VectorXd measured_C = run.measured_C.col(channel);
    const Eigen::VectorXd before_C = run.before_C.col(channel), after_C = run.after_C.col(channel);
    return fmt::format("<figure><figcaption>{}: {:.3f} &rarr; {:.3f} &deg;C</figcaption>{}{}</figure>",
                       escaped(run.channels[static_cast<std::size_t>(channel)]),
                       run.channel_before_rmse_C(channel), run.channel_after_rmse_C(channel),
                       svg_plot(run.time_s,
                                {{"measured", measured_colour, measured_C},
                                 {"before", before_colour, before_C},
                                 {"after", after_colour, after_C}},
                                "&#176;C", 150),
                       svg_plot(run.time_s,
                                {{"residual before", before_colour, measured_C - before_C},
                                 {"residual after", after_colour, measured_C - after_C}},
                                "&#916; &#176;C", 100));
}

std::string run_section(const RunComparison& run, const char* what) {
    std::string html = fmt::format(
        R"(<h2>{} <small>{}</small></h2><p><b style="color:{}">measured</b> <b style="color:{}">simulated before</b> <b style="color:{}">simulated after</b>; below each, measured less simulated.</p><div class="plots">)",
        escaped(run.name), what, measured_colour, before_colour, after_colour);
    for (Eigen::Index channel = 0; channel < run.measured_C.cols(); ++channel)
        html += channel_plots(run, channel);
    return html + "</div>";
}

std::string residual_heat_section(const Diagnosis& diagnosis) {
    if (diagnosis.residual_heat.empty()) return {};
    std::string html = "<h2>Where and when, before any name</h2><div class=\"plots\">";
    for (const ResidualHeat& heat : diagnosis.residual_heat) {
        const auto course = Eigen::Map<const Eigen::VectorXd>(heat.course.data(),
                                                              static_cast<Eigen::Index>(heat.course.size()));
        const auto sigma = Eigen::Map<const Eigen::VectorXd>(heat.sigma.data(),
                                                             static_cast<Eigen::Index>(heat.sigma.size()));
        html +=
            fmt::format("<figure><figcaption>{} {}: {:.0f} to {:.0f} min, follows {}</figcaption>{}</figure>",
                        heat.of_sensor ? "error of sensor" : "heat into", escaped(heat.at),
                        heat.from_s / 60.0, heat.to_s / 60.0, escaped(heat.follows),
                        svg_plot(heat.time_s,
                                 {{"course", after_colour, course},
                                  {"+2 sigma", "#bbb", course + 2.0 * sigma},
                                  {"-2 sigma", "#bbb", course - 2.0 * sigma}},
                                 heat.of_sensor ? "&#176;C" : "W", 130));
    }
    return html + "</div>";
}

constexpr char style[] =
    "body{font:15px/1.5 system-ui,sans-serif;margin:2em auto;max-width:1180px;color:#222;padding:0 1em}"
    "table{border-collapse:collapse;margin:.6em 0}td,th{border:1px solid #ccc;padding:.25em "
    ".7em;text-align:left}"
    "small{color:#777;font-weight:normal}figure{margin:0}figcaption{font-size:13px;color:#444}"
    ".plots{display:grid;grid-template-columns:repeat(auto-fill,minmax(560px,1fr));gap:12px}"
    "svg{display:block;max-width:100%}svg text{font-size:10px;fill:#666}svg .g{stroke:#eee}"
    "svg .l{fill:none;stroke-width:1.2}";

}  // namespace

std::string effect_in_words(const FoundEffect& found) {
    std::string words = plain_kind(found.effect.kind);
    if (!found.at.empty() && found.at != "all" && found.at != "ambient") words += ", at " + found.at;
    if (found.from_s > 60.0) words += fmt::format(", since {:.0f} min", found.from_s / 60.0);
    if (!found.parameters.empty()) words += ": " + number_in_words(found.parameters.front());
    return words;
}

std::string gap_report_html(const Diagnosis& diagnosis) {
    std::string html = fmt::format(
        "<!doctype html><html lang=\"en\"><meta charset=\"utf-8\"><title>Simulation and "
        "measurement</title><style>{}</style>"
        "<h1>Simulation and measurement</h1><p><b>{}</b><br><small>{}</small></p>",
        style, verdict_in_words(diagnosis), escaped(diagnosis.reason));
    html += gap_table(diagnosis);
    if (!diagnosis.effects.empty()) html += "<h2>What was missing</h2>";
    for (const FoundEffect& found : diagnosis.effects) html += effect_section(found);
    const bool rest =
        diagnosis.verdict == GapVerdict::unexplained || diagnosis.verdict == GapVerdict::partly_explained;
    if (rest) html += "<h2>What is left over</h2>" + evidence_table(diagnosis.suspects, nullptr);
    html += residual_heat_section(diagnosis);
    html += run_section(diagnosis.run, "fitted");
    for (const RunComparison& run : diagnosis.holdouts) html += run_section(run, "never fitted");
    return html + "</html>\n";
}

}  // namespace thermbal
