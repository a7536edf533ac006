#pragma once

#include <vector>

#include "explanation.hpp"

namespace thermbal {

/// What is believed before the data of a step are looked at, and how evidence is turned into odds.
struct OddsOptions {
    double nothing_missing = 0.55;
    double catalogue = 0.44;  ///< spread evenly over kinds, a kind's over its places
    double nameless = 0.01;
    /// Of a sensor's kinds against the others: where it sits in its node imitates its errors, and of that the
    /// model knows little. What effect-free machines were given a name for was mostly a sensor's (README.md).
    double share_of_sensors = 0.05;
    /// The nameless explanation also dresses up the model's own limits, which grow with the effect: it has to
    /// be better than the named one by this much before the name is doubted.
    double nameless_discount = 0.9;
    /// Of what a forecast gains; 0: by the run alone. At another speed the model's own limits are others than
    /// those that the run shows: on machines that nothing is missing from, forecasts gained 5 to 30 nats.
    double forecast_weight = 0.5;
};

/// Probabilities of what is missing next.
struct Odds {
    double nothing = 1.0;
    double nameless = 0.0;
    std::vector<Suspect>
        kinds;  ///< best first; probability of the kind anywhere, place of its best contender
    std::vector<std::size_t> best_of;  ///< index into Survey::contenders for each of kinds

    /// Only when that is more than twice as likely as not: who is told of an effect goes and looks for it.
    bool something_is_missing() const { return nothing < 0.3; }
};

Odds odds_of(const Survey& survey, const Model& model, const OddsOptions& options = {});

/// The same odds once it is known with a probability that it is one of the names.
Odds among_names(Odds odds, double probability);

}  // namespace thermbal
