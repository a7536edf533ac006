#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "regression/panels.hpp"
#include "regression/vector_loops.hpp"
#include "regression/whole_kernel.hpp"

namespace thermbal {

/// What TubeSolver minimises, by the same steps, for functions written by a coefficient a row of a whole
/// kernel matrix. A step costs as many of the matrix's columns as rows bend or change: less than features of
/// a rank above that number. Deterministic; one object a thread.
class DualSolver {
  public:
    struct State {
        Eigen::VectorXd coefficients;  ///< of every row of the kernel; 0 beyond them, here and below
        double bias = 0.0;
        Eigen::VectorXd residuals;  ///< target - function, of every row
    };

    /// What a step needs and no fit keeps: solvers that never step at once may have one between them.
    struct Workspace {
        PanelMatrix system;
        PanelCholesky factor;
        Eigen::VectorXd at_bending, of_bias;
        std::vector<double> of_bending;
    };

    /// `targets` and `is_trained` (1 or 0): one a row of the kernel, which must outlive it, as the workspace
    /// must, with zeros up to a multiple of eight.
    DualSolver(const WholeKernel& kernel, const Eigen::VectorXd& targets, Eigen::VectorXd is_trained,
               double epsilon, Workspace& workspace);

    /// Coefficients 0, bias the median target of the rows it is trained on.
    State cold_start() const;

    void start(double C, State from);
    /// To where a further step moves no prediction of the rows it is trained on by more than 0.3 of the
    /// smoothing. False if that took more than most_steps.
    [[nodiscard]] bool descend_to(double smoothing, int most_steps);

    const State& state() const { return state_; }
    /// alpha - alpha* of every row.
    const Eigen::VectorXd& coefficients() const { return slopes_; }

  private:
    bool descend(double smoothing, double still, int most_steps);
    void take_slopes();
    void newton_direction();
    void step_where_bending(double curvature, double bias_gradient, Workspace& work);
    double step_length() const;
    void centre_undetermined_bias();
    void add_kernel_columns(const std::vector<Eigen::Index>& rows, const std::vector<double>& factors);

    const WholeKernel* kernel_;
    const Eigen::VectorXd* targets_;
    Eigen::VectorXd is_trained_;
    vector_loops::Tube tube_;
    State state_;
    Eigen::VectorXd slopes_;
    std::vector<Eigen::Index> bending_;  ///< rows where the loss is quadratic
    std::vector<Eigen::Index> moving_;   ///< rows whose coefficient is not their slope, and by how much
    std::vector<double> excess_;
    // Of the step.
    Eigen::VectorXd direction_;  ///< of the coefficients
    double bias_direction_ = 0.0;
    Eigen::VectorXd of_kernel_;  ///< change of every prediction without the bias
    Eigen::VectorXd change_;     ///< of the predictions it is trained on
    Workspace* workspace_;
};

}  // namespace thermbal
