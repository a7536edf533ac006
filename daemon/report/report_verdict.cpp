#include <cmath>

#include <fmt/format.h>

#include "report/html.hpp"
#include "report_sections.hpp"

namespace thermbal {
namespace {

std::string fact(const std::string& value, const std::string& what) {
    return fmt::format("<div><b>{}</b><span>{}</span></div>", value, what);
}

std::string headline(const TestReport& report, const TestAnswer& answer) {
    switch (answer.kind) {
        case TestAnswer::Kind::declared:
            return fmt::format("{} channels settle; the slowest, {}, by {}",
                               answer.declared == answer.waited_for && answer.declared > 1
                                   ? fmt::format("All {}", answer.declared)
                                   : fmt::format("{}", answer.declared),
                               escaped(answer.slowest), duration(answer.balance_min));
        case TestAnswer::Kind::open:
            return fmt::format("{} of {} channels known; {} not yet", answer.declared, answer.waited_for,
                               answer.undecided.size());
        case TestAnswer::Kind::none:
            break;
    }
    return fmt::format("Where the machine settles is not known after {}",
                       duration(report.window.end_s() / 60.0));
}

std::string who_and_when(const TestReport& report) {
    std::string line;
    for (const std::string& part :
         {report.name, report.machine, report.started, report.source, report.state}) {
        if (!part.empty())
            line +=
                (line.empty() ? "" : " &middot; ") + ("<span class=\"name\">" + escaped(part) + "</span>");
    }
    return "<p class=\"quiet\">" + line + "</p>";
}

const ReportChannel* warmest(const TestReport& report) {
    const ReportChannel* found = nullptr;
    for (const ReportChannel& channel : report.channels) {
        if (!channel.verdict || !channel.verdict->declared()) continue;
        if (found == nullptr || channel.verdict->steady_state_C > found->verdict->steady_state_C)
            found = &channel;
    }
    return found;
}

std::string facts(const TestReport& report, const TestAnswer& answer) {
    std::string html = "<div class=\"facts\">";
    html += fact(duration(answer.balance_min),
                 fmt::format("thermal balance: 95&nbsp;% of the rise of {}, 90&nbsp;% sure of {} to {}",
                             escaped(answer.slowest), duration(answer.balance_low_min),
                             duration(answer.balance_high_min)));
    html += fact(duration(answer.known_min), "measured until this was known and proved");
    if (answer.saved_min() > 0)
        html += fact(fmt::format("{:.1f} h", answer.saved_min() / 60.0),
                     "saved against waiting for 95&nbsp;% of the rise");
    html += fact(fmt::format("&plusmn;{:.2f} &deg;C", answer.widest_half_C),
                 "widest 90&nbsp;% interval of a declared temperature");
    if (const ReportChannel* const channel = warmest(report))
        html += fact(degrees(channel->verdict->steady_state_C, 1) + " &deg;C",
                     fmt::format("warmest: {} {}", escaped(channel->name), escaped(channel->place)));
    return html + "</div>";
}

}  // namespace

std::string verdict_section(const TestReport& report, const TestAnswer& answer) {
    const char* const kind = report.state == "aborted"                   ? " bad"
                             : answer.kind == TestAnswer::Kind::declared ? ""
                                                                         : " open";
    std::string html = fmt::format("<div class=\"verdict{}\"><h1>{}</h1>{}", kind, headline(report, answer),
                                   who_and_when(report));
    if (!report.end_reason.empty())
        html += report.state == "recording"
                    ? "<p>" + escaped(report.end_reason) + "</p>"
                    : fmt::format("<p>{} after {}: {}</p>", report.state == "aborted" ? "Aborted" : "Ended",
                                  duration(report.window.end_s() / 60.0), escaped(report.end_reason));
    if (answer.declared > 0) html += facts(report, answer);
    if (!answer.undecided.empty()) {
        html += "<p><b>Not known:</b></p><ul>";
        for (const std::string& one : answer.undecided) html += "<li>" + escaped(one) + "</li>";
        html += "</ul>";
    }
    return html + "</div>";
}

}  // namespace thermbal
