#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "base/error.hpp"
#include "channel_model.hpp"
#include "design.hpp"
#include "mode_sampler.hpp"
#include "modes/spectrum.hpp"

namespace thermbal {

/// One structural channel with enough good samples to say something.
struct ObservedChannel {
    std::string name;
    ReducedChannel data;
    double scale_C = 0.0;       ///< what it moves, as the priors of its amplitudes see it
    double test_start_C = 0.0;  ///< level at the start of the test if the window begins later, else NaN
    Eigen::MatrixXd responses;  ///< of earlier tests, see BackgroundPrior; empty without
};

/// A window, its inputs and all that is believed before its samples are looked at.
struct SpectrumProblem {
    TestWindow window;  ///< without spikes
    AmbientInput room;
    double room_before_C = 0.0;  ///< what the room moved from the start of the test to the window's
    Basis basis;
    std::vector<double> fine_grid;  ///< time constants of the modes' grid, min
    std::size_t scans_per_block = 1;
    Eigen::MatrixXd design;  ///< of the basis, a row a block
    std::vector<ObservedChannel> channels;
    Eigen::VectorXd functional;  ///< steady state = functional * coefficients of the basis
    BackgroundPrior background;
    ModePrior modes;
    double direction = 0.0;  ///< +1 if all channels warm, -1 if all cool, towards 0 as they disagree
};

/// Errors (refuse_input) as estimate_spectrum.
Result<SpectrumProblem> pose_problem(const TestWindow& recorded, std::string_view ambient,
                                     const std::optional<SpectrumPrior>& prior,
                                     const SpectrumOptions& options,
                                     const std::vector<double>& start_level_C);

std::vector<ChannelModel> channel_models(const SpectrumProblem& problem, const SpectrumOptions& options);

/// `kept` states of the modes given the samples of all channels.
std::vector<std::vector<Mode>> mode_states(const SpectrumProblem& problem,
                                           const std::vector<ChannelModel>& models,
                                           const SpectrumOptions& options, std::size_t kept,
                                           std::uint64_t seed);

/// The machine answers the room through the same modes as the heat: the response to the room is expected
/// where `states` found them, slow ones most.
void tie_room_to_modes(const std::vector<std::vector<Mode>>& states, const SpectrumOptions& options,
                       SpectrumProblem& problem);

}  // namespace thermbal
