#include "scan.hpp"

#include <algorithm>
#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <utility>

#include <fmt/format.h>

#include "modbus/unit.hpp"

namespace thermbal {
namespace {

using Steady = std::chrono::steady_clock;

/// The whole of one probe: a link at a time, with the time that is left.
class Probe {
  public:
    explicit Probe(const ProbeOptions& options)
        : options_(options),
          give_up_(Steady::now() + std::chrono::duration_cast<Steady::duration>(
                                       std::chrono::duration<double>(options.limit_s))) {}

    ProbeResult run() {
        if (options_.link.transport != Transport::rtu) {
            look_at(options_.link);
            return std::move(result_);
        }
        for (const int baud : options_.bauds) {
            for (const char parity : options_.parities) {
                LinkOptions link = options_.link;
                link.baud = baud;
                link.parity = parity;
                // A line has one speed: where somebody answers, the others are not asked.
                if (look_at(link)) return std::move(result_);
            }
        }
        return std::move(result_);
    }

  private:
    bool in_time() {
        result_.out_of_time = result_.out_of_time || Steady::now() > give_up_;
        return !result_.out_of_time;
    }

    Result<std::vector<std::uint16_t>> read(int unit_id, int function, int first, int count) {
        ++result_.requests;
        return link_->read_block(unit_id, function, first, count);
    }

    /// Whether anybody answered.
    bool look_at(const LinkOptions& settings) {
        link_ = make_link(settings);
        bool anybody = false;
        for (int unit_id = options_.first_unit; unit_id <= options_.last_unit && in_time(); ++unit_id) {
            switch (ask(unit_id)) {
                case Answer::nobody_can:
                    return anybody;
                case Answer::silence:
                    break;
                case Answer::there:
                    anybody = true;
                    look_into(settings, unit_id);
                    break;
            }
        }
        return anybody;
    }

    enum class Answer : std::uint8_t { silence, there, nobody_can };

    /// An exception is an answer as well, unless a gateway says that nobody is behind it.
    Answer ask(int unit_id) {
        const auto failures = link_->counters().connect_failures;
        for (const int function : {4, 3}) {
            const auto reply = read(unit_id, function, 0, 1);
            if (reply) return Answer::there;
            const std::string& message = reply.error().message;
            if (link_->counters().connect_failures > failures ||
                reply.error().next == NextStep::refuse_input) {
                result_.trouble.push_back(message);
                return Answer::nobody_can;
            }
            if (reply.error().next != NextStep::retry) continue;
            const bool from_gateway = message.find("exception 10 ") != std::string::npos ||
                                      message.find("exception 11 ") != std::string::npos;
            if (!from_gateway) return Answer::there;
        }
        return Answer::silence;
    }

    void look_into(const LinkOptions& settings, int unit_id) {
        ProbedUnit unit{.link = settings, .unit_id = unit_id, .blocks = {}, .readings = {}, .fits = {}};
        for (const ModuleProfile& profile : options_.profiles) {
            if (!in_time()) break;
            if (auto fit = try_profile(unit_id, profile)) unit.fits.push_back(std::move(*fit));
        }
        std::ranges::stable_sort(unit.fits,
                                 [](const ProfileFit& a, const ProfileFit& b) { return rank(a) > rank(b); });
        for (const int function : {4, 3}) read_all(unit_id, function, unit.blocks);
        for (const RegisterBlock& block : unit.blocks) {
            for (Reading& reading : rank_readings(block, 6)) unit.readings.push_back(std::move(reading));
        }
        std::ranges::stable_sort(unit.readings, std::greater<>(), &Reading::score);
        if (unit.readings.size() > 8) unit.readings.resize(8);
        result_.units.push_back(std::move(unit));
    }

    static double rank(const ProfileFit& fit) {
        return (fit.types_confirmed ? 1000.0 : 0.0) + fit.fit * fit.profile.inputs;
    }

    std::optional<ProfileFit> try_profile(int unit_id, const ModuleProfile& profile) {
        std::vector<Sample> samples;
        for (const BlockRead& block : plan_blocks(profile)) {
            const auto words = in_time() ? read(unit_id, profile.function, block.first, block.count)
                                         : fail(NextStep::stop, "out of time");
            if (!words) return std::nullopt;
            for (int input = 0; input < block.inputs; ++input) {
                const auto at = static_cast<std::size_t>(input) * static_cast<std::size_t>(profile.stride);
                samples.push_back(decode(profile, std::span(*words).subspan(at)));
            }
        }
        ProfileFit fit{
            .profile = profile, .fit = fit_of(profile, samples), .types_confirmed = false, .types = {}};
        if (fit.fit <= 0.25) return std::nullopt;
        if (profile.type_code) confirm_types(unit_id, profile, fit);
        return fit;
    }

    void confirm_types(int unit_id, const ModuleProfile& profile, ProfileFit& fit) {
        const auto codes = read_type_codes(*link_, unit_id, profile);
        ++result_.requests;
        if (!codes) {
            fit.types = "cannot be read: " + codes.error().message;
            return;
        }
        const std::string wrong = wrong_types(profile, *codes);
        fit.types_confirmed = wrong.empty();
        fit.types = wrong.empty() ? "are those of the profile" : wrong;
    }

    /// All registers from 0 on that the unit lets us read, as few blocks as it takes: a module refuses a read
    /// that goes beyond its map as a whole.
    void read_all(int unit_id, int function, std::vector<RegisterBlock>& blocks) {
        RegisterBlock block{.function = function, .first = 0, .words = {}};
        const auto close = [&](int next) {
            if (!block.words.empty()) blocks.push_back(block);
            block = RegisterBlock{.function = function, .first = next, .words = {}};
        };
        int step = 32;
        int refused_in_a_row = 0;
        for (int at = 0; at <= options_.last_register && in_time();) {
            const int count = std::min(step, options_.last_register + 1 - at);
            const auto words = read(unit_id, function, at, count);
            if (words) {
                block.words.insert(block.words.end(), words->begin(), words->end());
                at += count;
                refused_in_a_row = 0;
                continue;
            }
            if (words.error().next != NextStep::retry) return close(at);
            if (count > 1) {
                step = count / 2;
                continue;
            }
            close(at + 1);
            ++at;
            // A map with holes every few registers is read on; behind its end nothing is.
            if (++refused_in_a_row == 4) return;
            step = 32;
        }
        close(0);
    }

    const ProbeOptions& options_;
    const Steady::time_point give_up_;
    std::unique_ptr<Link> link_;
    ProbeResult result_;
};

}  // namespace

ProbeResult probe(const ProbeOptions& options) {
    return Probe(options).run();
}

}  // namespace thermbal
