#include "regression/panels.hpp"

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "regression/newton_system.hpp"

namespace thermbal::test {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

PanelMatrix in_panels(const MatrixXd& matrix) {
    PanelMatrix panels;
    panels.set_zero(static_cast<std::size_t>(matrix.rows()), static_cast<std::size_t>(matrix.cols()));
    for (Index j = 0; j < matrix.cols(); ++j) {
        for (Index i = 0; i < matrix.rows(); ++i) {
            panels.at(static_cast<std::size_t>(i), static_cast<std::size_t>(j)) = matrix(i, j);
        }
    }
    return panels;
}

MatrixXd from_panels(const PanelMatrix& panels) {
    return MatrixXd::NullaryExpr(static_cast<Index>(panels.padded_rows()),
                                 static_cast<Index>(panels.columns()), [&](Index i, Index j) {
                                     return panels.at(static_cast<std::size_t>(i),
                                                      static_cast<std::size_t>(j));
                                 });
}

double largest_below_diagonal(const MatrixXd& matrix) {
    return MatrixXd(matrix.triangularView<Eigen::Lower>()).cwiseAbs().maxCoeff();
}

TEST(Panels, ProductsAreThoseOfEigen) {
    for (const Index rows : {8, 16, 40, 104}) {
        const MatrixXd V = MatrixXd::Random(rows, 11);
        const MatrixXd W = MatrixXd::Random(13, 11);
        PanelMatrix out;
        products(in_panels(V), in_panels(W), out);
        EXPECT_LT((from_panels(out).leftCols(13) - V * W.transpose()).cwiseAbs().maxCoeff(), 1e-12);
        PanelMatrix lower = in_panels(MatrixXd::Ones(rows, rows));
        add_products(in_panels(V), -1.0, lower);
        EXPECT_LT(largest_below_diagonal(from_panels(lower) - MatrixXd::Ones(rows, rows) + V * V.transpose()),
                  1e-12);
    }
}

TEST(Panels, CholeskySolvesWhatEigenSolves) {
    for (const Index rows : {8, 16, 40, 104, 200}) {
        const MatrixXd V = MatrixXd::Random(rows, rows + 5);
        const MatrixXd A = V * V.transpose() + MatrixXd::Identity(rows, rows);
        const VectorXd b = VectorXd::Random(rows);
        PanelMatrix lower;
        lower.set_zero_lower(static_cast<std::size_t>(rows));
        for (Index i = 0; i < rows; ++i) {
            for (Index j = 0; j <= i; ++j)
                lower.at(static_cast<std::size_t>(i), static_cast<std::size_t>(j)) = A(i, j);
        }
        PanelCholesky cholesky;
        cholesky.factor(lower);
        VectorXd x = b;
        cholesky.solve(x.data());
        EXPECT_LT((A * x - b).norm(), 1e-11 * A.norm() * x.norm());
        EXPECT_LT(largest_below_diagonal(from_panels(lower) - MatrixXd(A.llt().matrixL())), 1e-11 * A.norm());
    }
}

/// One system for changing rows, few and many, so that what it keeps is brought up to date, made anew, and
/// used in both spaces: every direction must solve the equations of the header.
void expect_directions_of(const Index all_rows) {
    const Index rank = 16;
    const MatrixXd by_row = MatrixXd::Random(rank, all_rows);
    const VectorXd gradient = VectorXd::Random(rank);
    NewtonSystem system(by_row);
    const auto every = [](Index first, Index step, Index end) {
        std::vector<Index> rows;
        for (Index row = first; row < end; row += step) rows.push_back(row);
        return rows;
    };
    const std::vector<std::vector<Index>> steps{every(0, 1, 60), every(0, 1, 55), every(3, 1, 57),
                                                every(0, 2, 60), every(0, 6, 60), every(0, 6, 55),
                                                every(6, 6, 60), every(5, 9, 60), {17},
                                                every(1, 2, 60), every(9, 4, 60)};
    NewtonSystem::Direction direction;
    for (const auto& bending : steps) {
        for (const double curvature : {0.5, 1e6}) {
            SCOPED_TRACE(std::to_string(bending.size()) + " rows, curvature " + std::to_string(curvature));
            system.solve(bending, curvature, gradient, 0.7, direction);
            const MatrixXd X = by_row(Eigen::all, bending).transpose();
            const VectorXd moved = X * direction.weights + VectorXd::Constant(X.rows(), direction.bias);
            const VectorXd off = direction.weights + curvature * X.transpose() * moved + gradient;
            EXPECT_LT(off.norm(),
                      1e-13 * curvature * (1.0 + direction.weights.norm() * X.squaredNorm()) + 1e-12);
            EXPECT_NEAR(curvature * moved.sum(), -0.7,
                        1e-13 * curvature * (1.0 + direction.weights.norm() * X.norm()) + 1e-12);
        }
    }
}

TEST(NewtonSystem, DirectionsSolveTheEquationsWhateverRowsCameBefore) {
    expect_directions_of(60);
}

/// So many that the products of all rows with one another are not kept.
TEST(NewtonSystem, DirectionsSolveTheEquationsAmongManyRows) {
    expect_directions_of(900);
}

}  // namespace
}  // namespace thermbal::test
