#pragma once

#include <cmath>
#include <span>
#include <string>
#include <vector>

#include "network/model.hpp"

namespace thermbal {

/// One number of a model that a fit may move. The fitted coordinate is ln(value) when logarithmic, else the
/// value; prior_centre is a value, prior_sigma the standard deviation of the coordinate (infinite: flat
/// between the bounds).
struct Parameter {
    std::string name;  ///< "front_bearing-sleeve.conductance_W_per_K", "coolant_cycling(sleeve).power_W"
    double value = 0.0;
    double lower = 0.0;
    double upper = 0.0;
    bool logarithmic = true;
    double prior_centre = 0.0;
    double prior_sigma = 0.0;
    bool is_time = false;    ///< an onset or a switching: the residual is not smooth in it at the samples
    bool of_effect = false;  ///< else of the base network
    std::size_t effect = 0;  ///< index into Model::effects when of_effect

    /// "power_W"
    std::string short_name() const { return name.substr(name.rfind('.') + 1); }
    double to_coordinate(double natural) const { return logarithmic ? std::log(natural) : natural; }
    double to_value(double coordinate) const { return logarithmic ? std::exp(coordinate) : coordinate; }
    /// (coordinate - prior) / sigma; 0 for a flat prior.
    double prior_residual(double natural) const {
        return std::isinf(prior_sigma) ? 0.0
                                       : (to_coordinate(natural) - to_coordinate(prior_centre)) / prior_sigma;
    }
};

/// All numbers of the model that are not known exactly, in a fixed order: capacities, conductances, powers
/// and exponents, the ambient, then effect by effect. The model's own values are the priors' centres in the
/// base network; an effect's parameter has the catalogue's prior, or value and sigma of the fit that it came
/// from. REQUIRES: validate(model).
std::vector<Parameter> parameters_of(const Model& model);

/// Puts values (natural units, the order of parameters_of(model)) into the model. The structure and the
/// sigmas stay.
void set_parameter_values(Model& model, std::span<const double> values);

/// A standard deviation of the fitted coordinate as one in the number's own unit, at this value.
double sigma_in_unit(bool logarithmic, double value, double coordinate_sigma);

/// States how well each number is known, as standard deviations in the fitted coordinates: relative_sigma for
/// the base network, sigma for effects. What a calibration leaves behind in its model.
void set_parameter_sigmas(Model& model, std::span<const double> coordinate_sigmas);

}  // namespace thermbal
