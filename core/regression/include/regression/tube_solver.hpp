#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "regression/newton_system.hpp"
#include "regression/vector_loops.hpp"

namespace thermbal {

/// epsilon-SVR on explicit features, minimising
///     1/2 |w|^2 + C sum_i max(0, |y_i - w . x_i - b| - epsilon)
/// by Newton's method on the loss with its kink smoothed (an epsilon-insensitive Huber loss), the smoothing
/// being taken from step to step towards 0. The slope of the smoothed loss at each row is the row's dual
/// coefficient: it always keeps |c_i| <= C, and a smoothing h moves the fit by at most about h.
/// Deterministic; one object a thread.
class TubeSolver {
  public:
    struct State {
        Eigen::VectorXd weights;
        double bias = 0.0;
    };

    struct Schedule {
        double first_smoothing = 0.5;
        double factor = 0.1;
        double last_smoothing = 1e-6;
        int most_steps = 100;  ///< of Newton, at one smoothing
    };

    /// On some rows of system.by_row(), ascending, with a target each. `system` must outlive it.
    TubeSolver(NewtonSystem& system, std::vector<Eigen::Index> rows, Eigen::VectorXd targets, double epsilon);

    /// Weights 0, bias the median target.
    State cold_start() const;

    /// Goes on from `start`. False if a smoothing took more than most_steps: the state is then not the
    /// optimum.
    [[nodiscard]] bool fit(double C, const State& start, const Schedule& schedule);

    /// The two halves of fit(): C and where to start from, then one smoothing after the other, each to where
    /// a further step moves no prediction by more than 0.3 of it. False as fit().
    void start(double C, const State& start);
    /// Instead, from the regularised least squares fit to all rows, the squares weighed C / (2 smoothing):
    /// nothing is known yet, and a wide smoothing would come close to that in many steps.
    void start_at_least_squares(double C, double smoothing);
    [[nodiscard]] bool descend_to(double smoothing, int most_steps);

    const State& state() const { return state_; }
    /// alpha - alpha* of every row.
    const Eigen::VectorXd& coefficients() const { return slopes_; }
    /// No row is held back by C: every larger C has the same optimum.
    bool is_free_of_C() const;
    /// Primal minus dual objective: no other fit on these features has a primal objective smaller by more
    /// than this.
    double duality_gap() const;
    long newton_steps() const { return newton_steps_; }

  private:
    [[nodiscard]] bool descend(double smoothing, double still, int most_steps);
    void take_slopes();
    void newton_direction();
    void predict_rows(const Eigen::VectorXd& weights, double bias, Eigen::VectorXd& out) const;
    double step_length() const;
    void centre_undetermined_bias();

    NewtonSystem* system_;
    std::vector<Eigen::Index> rows_;
    Eigen::VectorXd targets_;
    double epsilon_;

    vector_loops::Tube tube_;
    State state_;
    Eigen::VectorXd residuals_;
    Eigen::VectorXd slopes_, new_slopes_;
    Eigen::VectorXd slope_sum_;          ///< sum over rows of slope * features
    std::vector<Eigen::Index> changed_;  ///< rows whose slope has changed, and by how much
    std::vector<double> slope_changes_;
    std::vector<Eigen::Index> bending_;  ///< rows where the loss is quadratic
    Eigen::VectorXd gradient_;
    double bias_gradient_ = 0.0;
    NewtonSystem::Direction direction_;
    Eigen::VectorXd change_;  ///< of the prediction of every row along the direction
    long newton_steps_ = 0;
};

}  // namespace thermbal
