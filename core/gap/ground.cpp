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

Result<Eigen::VectorXd> ScreeningGround::change_by(const Effect& effect) const {
    Eigen::VectorXd change(linearisation_->samples());
    Index row = 0;
    for (const Run& run : runs_) {
        const auto here = run.problem.change_by(run.fit, effect);
        if (!here) return std::unexpected(here.error());
        const Eigen::VectorXd some = pooled(*here, run.fit.point.simulated_C.rows());
        change.segment(row, some.size()) = some;
        row += some.size();
    }
    return change;
}

}  // namespace thermbal
