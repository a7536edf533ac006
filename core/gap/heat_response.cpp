#include "heat_response.hpp"

#include <algorithm>
#include <utility>

#include "network/effect.hpp"

namespace thermbal {

CourseOfReadings::CourseOfReadings(const std::vector<double>& time_s, Eigen::MatrixXd after_C)
    : time_s_(&time_s), after_C_(std::move(after_C)) {}

Eigen::RowVectorXd CourseOfReadings::at(double since_s) const {
    const std::vector<double>& time_s = *time_s_;
    if (since_s <= 0.0) return Eigen::RowVectorXd::Zero(after_C_.cols());
    const double t = time_s.front() + since_s;
    const auto after = std::ranges::upper_bound(time_s, t) - time_s.begin();
    if (static_cast<std::size_t>(after) >= time_s.size()) return after_C_.row(after_C_.rows() - 1);
    const double t0 = time_s[static_cast<std::size_t>(after) - 1],
                 t1 = time_s[static_cast<std::size_t>(after)];
    const double share = (t - t0) / (t1 - t0);
    return (1.0 - share) * after_C_.row(after - 1) + share * after_C_.row(after);
}

CourseOfReadings CourseOfReadings::integrated() const {
    Eigen::MatrixXd integral = Eigen::MatrixXd::Zero(after_C_.rows(), after_C_.cols());
    for (Eigen::Index row = 1; row < integral.rows(); ++row) {
        const auto k = static_cast<std::size_t>(row);
        integral.row(row) = integral.row(row - 1) + 0.5 * ((*time_s_)[k] - (*time_s_)[k - 1]) *
                                                        (after_C_.row(row) + after_C_.row(row - 1));
    }
    return {*time_s_, std::move(integral)};
}

Result<CourseOfReadings> answer_to_heat(const FitProblem& problem, const Fit& fit, const std::string& node) {
    const EffectDefinition& steady = *find_effect("motor_heat");
    const Effect heat = make_effect(steady, steady.forms.front(), node, fit.model);
    auto change_C = problem.reading_change_by(fit, heat);
    if (!change_C) return std::unexpected(change_C.error());
    return CourseOfReadings(problem.data().seen.time_s, *change_C / heat.parameters.front().value);
}

}  // namespace thermbal
