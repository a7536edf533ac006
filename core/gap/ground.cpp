#include "ground.hpp"

#include "pooling.hpp"

namespace thermbal {

using Eigen::Index;

ScreeningGround::ScreeningGround(const Evidence& evidence, const Explanation& current)
    : evidence_(&evidence), current_(&current) {
    const Index samples = current.fit.point.simulated_C.size();
    const Eigen::MatrixXd here = current.fit.jacobian.topRows(samples);
    runs_.push_back({FitProblem(evidence.run, current.fit.model), current.fit,
                     pooled(here, current.fit.point.simulated_C.rows())});
    for (const FitData& holdout : evidence.holdouts) {
        auto there = forecast(holdout, evidence, current);
        if (!there) continue;
        Fit fit{current.fit.model, {}, std::move(there->point), {}, {}, 0, true};
        const Index rows = fit.point.simulated_C.rows();
        runs_.push_back(
            {FitProblem(holdout, current.fit.model), std::move(fit), pooled(there->sensitivity, rows)});
    }
    stack();
    linearisation_.emplace(stacked_);
}

/// Columns: the fit's own coordinates, then the starts of every held-out run. Rows: the readings of all runs,
/// the priors.
void ScreeningGround::stack() {
    const Index numbers = static_cast<Index>(current_->fit.parameters.size());
    const Index own = current_->fit.jacobian.cols();
    const Index own_starts = static_cast<Index>(evidence_->run.starts.size());
    Index rows = 0, columns = own;
    for (const Run& run : runs_) rows += run.sensitivity.rows();
    for (std::size_t k = 1; k < runs_.size(); ++k)
        columns += static_cast<Index>(runs_[k].problem.data().starts.size());
    stacked_.jacobian = Eigen::MatrixXd::Zero(rows + columns, columns);
    stacked_.point.residual = Eigen::VectorXd::Zero(rows + columns);
    Index row = 0, column = own;
    for (std::size_t k = 0; k < runs_.size(); ++k) {
        const Run& run = runs_[k];
        const Index samples = run.sensitivity.rows();
        const Index readings = run.fit.point.simulated_C.size();
        stacked_.point.residual.segment(row, samples) =
            pooled(run.fit.point.residual.head(readings), run.fit.point.simulated_C.rows());
        if (k == 0) {
            stacked_.jacobian.block(0, 0, samples, own) = run.sensitivity;
        } else {
            const Index starts = static_cast<Index>(run.problem.data().starts.size());
            const Index places =
                std::min(own - numbers - own_starts, run.sensitivity.cols() - numbers - starts);
            stacked_.jacobian.block(row, 0, samples, numbers) = run.sensitivity.leftCols(numbers);
            stacked_.jacobian.block(row, column, samples, starts) =
                run.sensitivity.middleCols(numbers, starts);
            stacked_.jacobian.block(row, numbers + own_starts, samples, places) =
                run.sensitivity.rightCols(places);
            for (Index i = 0; i < starts; ++i) {
                const double sigma_C = run.problem.data().starts[static_cast<std::size_t>(i)].sigma_C;
                stacked_.jacobian(rows + column + i, column + i) = 1.0 / sigma_C;
            }
            column += starts;
        }
        row += samples;
    }
    stacked_.jacobian.block(rows, 0, own, own) = current_->fit.jacobian.bottomRows(own);
    stacked_.point.residual.segment(rows, own) = current_->fit.point.residual.tail(own);
    stacked_.hessian = stacked_.jacobian.transpose() * stacked_.jacobian;
}

template <typename ChangeOfRun>
Result<Eigen::VectorXd> ScreeningGround::stacked(ChangeOfRun whitened_change) const {
    Eigen::VectorXd change(linearisation_->samples());
    Index row = 0;
    for (std::size_t k = 0; k < runs_.size(); ++k) {
        const Result<Eigen::VectorXd> here = whitened_change(k);
        if (!here) return std::unexpected(here.error());
        const Eigen::VectorXd some = pooled(*here, runs_[k].fit.point.simulated_C.rows());
        change.segment(row, some.size()) = some;
        row += some.size();
    }
    return change;
}

Result<Eigen::VectorXd> ScreeningGround::change_by(const Effect& effect) const {
    return stacked([&](std::size_t k) { return runs_[k].problem.change_by(runs_[k].fit, effect); });
}

Result<std::vector<CourseOfReadings>> ScreeningGround::courses_from_the_beginning(
    Effect effect, const std::string& onset) const {
    std::vector<CourseOfReadings> courses;
    for (const Run& run : runs_) {
        const std::vector<double>& time_s = run.problem.data().seen.time_s;
        effect.set_parameter(onset, time_s.front());
        auto change_C = run.problem.reading_change_by(run.fit, effect);
        if (!change_C) return std::unexpected(change_C.error());
        courses.emplace_back(time_s, std::move(*change_C));
    }
    return courses;
}

Eigen::VectorXd ScreeningGround::change_from(const std::vector<CourseOfReadings>& courses, double onset_s,
                                             bool remembers) const {
    return *stacked([&](std::size_t k) -> Result<Eigen::VectorXd> {
        const FitData& data = runs_[k].problem.data();
        Eigen::MatrixXd change_C = Eigen::MatrixXd::Zero(courses[k].rows(), courses[k].columns());
        for (Index row = 0; row < change_C.rows(); ++row) {
            const double since_s = data.seen.time_s[static_cast<std::size_t>(row)] - onset_s;
            if (since_s < 0.0) continue;
            change_C.row(row) =
                courses[k].at(remembers ? since_s : since_s + onset_s - data.seen.time_s.front());
        }
        return data.whitening(change_C);
    });
}

}  // namespace thermbal
