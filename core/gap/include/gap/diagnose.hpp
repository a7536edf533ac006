#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "base/error.hpp"
#include "base/parallel.hpp"
#include "gap/calibrate.hpp"
#include "network/model.hpp"
#include "series/recorded_test.hpp"

namespace thermbal {

/// A run of the same machine that nothing is fitted to.
struct Holdout {
    std::string name;
    RecordedTest test;
};

struct DiagnoseOptions {
    CalibrationOptions calibration;
    int max_effects = 3;
    double probability_to_name = 0.5;   ///< a less probable effect is an alternative, never a name
    double probability_to_list = 0.01;  ///< of an alternative
    std::string found_on;               ///< provenance of what is written into the model
};

enum class GapVerdict { agrees, explained, partly_explained, unexplained };
std::string_view to_string(GapVerdict verdict);

/// Where the calibrated model and the measurement differ by more than noise and fidelity allow.
struct Disagreement {
    std::string channel;
    double from_s = 0.0;
    double to_s = 0.0;
    double rms_C = 0.0;
    double peak_C = 0.0;
    double sigmas = 0.0;  ///< peak of the smoothed residual over what is allowed
};

/// A kind that could be it, at its best place.
struct Suspect {
    std::string kind;  ///< empty: heat or a sensor's error of a course that no effect of the catalogue has
    std::string at;
    double probability = 0.0;
    double log_bayes_factor = 0.0;  ///< over "nothing more is missing", its freedoms paid for
};

/// An experiment that would tell an effect from a suspect: both are simulated.
struct SeparatingExperiment {
    /// From half way through a run of the same length at constant speed in a constant room on.
    enum class Kind { cool_down, second_speed, room_step };
    std::string against;     ///< kind of effect
    std::string against_at;  ///< its place
    Kind kind = Kind::cool_down;
    std::string channel;        ///< where the two would differ most
    double difference_C = 0.0;  ///< there, beyond what going on unchanged would show
    double sigmas = 0.0;        ///< of the difference over the whole experiment
    bool separates = false;     ///< whether that is enough to tell them apart
};
/// "cool_down"; and what to do, in plain words.
std::string_view to_string(SeparatingExperiment::Kind kind);
std::string_view in_words(SeparatingExperiment::Kind kind);

struct FoundEffect {
    Effect effect;
    std::string at;                     ///< node or channel; "ambient", "all" where it acts everywhere
    std::vector<std::string> channels;  ///< whose readings it changes by more than their noise
    double from_s = 0.0;
    double to_s = 0.0;
    double probability = 0.0;
    bool in_doubt = false;  ///< stands for something that it does not describe well
    std::vector<CalibratedParameter> parameters;
    std::optional<double> cycle_s;  ///< of a thermostat: from one switching on to the next in this run, mean
    std::vector<Suspect> alternatives;
    std::vector<SeparatingExperiment> experiments;  ///< alternatives in their order, clearest first
    double rmse_before_C = 0.0;
    double rmse_after_C = 0.0;
};

/// One run: measured, and simulated by the calibrated model without and with the effects found. Rows: the
/// run's scans. The start of every node is estimated within the noise of its first reading; nothing else is
/// fitted to a held-out run.
struct RunComparison {
    std::string name;
    std::vector<double> time_s;
    std::vector<std::string> channels;
    Eigen::MatrixXd measured_C, before_C, after_C;
    double before_rmse_C = 0.0, after_rmse_C = 0.0;
    Eigen::VectorXd channel_before_rmse_C, channel_after_rmse_C;
};

/// What is left over has a place and a course, even without a name.
struct ResidualHeat {
    std::string at;
    bool of_sensor = false;
    double log_bayes_factor = 0.0;
    double from_s = 0.0, to_s = 0.0;
    std::vector<double> time_s;
    std::vector<double> course, sigma;  ///< W for a node, C for a sensor
    std::string follows;                ///< "speed", "ambient", "own temperature", "time"
};

struct Diagnosis {
    GapVerdict verdict = GapVerdict::agrees;
    std::string reason;
    std::vector<Disagreement> disagreements;  ///< of the model without effects
    std::vector<FoundEffect> effects;
    std::vector<Suspect> suspects;            ///< when nothing is named: what it might be, best first
    std::vector<ResidualHeat> residual_heat;  ///< before any effect, best first
    RunComparison run;
    std::vector<RunComparison> holdouts;
    Model calibrated;
    Model extended;
    double share_of_rise = 0.0;  ///< the fidelity that the data asked for
};

/// The gap workflow, from top to bottom. `holdouts` are never fitted: they only weigh how well each
/// explanation predicts. Errors: those of calibrate. Any thread; parallel_for says how work is spread.
Result<Diagnosis> diagnose(const Model& model, const RecordedTest& test, std::span<const Holdout> holdouts,
                           const DiagnoseOptions& options, const ParallelFor& parallel_for);

}  // namespace thermbal
