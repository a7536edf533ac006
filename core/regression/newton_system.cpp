#include "regression/newton_system.hpp"

#include <algorithm>
#include <cstring>
#include <numeric>
#include <span>

#include "regression/vector_loops.hpp"

namespace thermbal {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

/// Every change leaves a rounding behind.
constexpr int most_changes = 64;

constexpr std::size_t height = PanelMatrix::height;

/// So many rows have all their products with one another kept: 5 MB.
constexpr std::size_t most_rows_multiplied_once = 800;

/// So many rows' features at a time: they stay in the cache while they are multiplied.
constexpr std::size_t gathered_at_once = 64;

/// What is in one of two ascending lists alone.
void differences(const std::vector<Index>& a, const std::vector<Index>& b, std::vector<Index>& in_a_alone,
                 std::vector<Index>& in_b_alone) {
    in_a_alone.clear();
    in_b_alone.clear();
    auto next_a = a.begin();
    auto next_b = b.begin();
    while (next_a != a.end() && next_b != b.end()) {
        if (*next_a == *next_b) {
            ++next_a;
            ++next_b;
        } else if (*next_a < *next_b) {
            in_a_alone.push_back(*next_a++);
        } else {
            in_b_alone.push_back(*next_b++);
        }
    }
    in_a_alone.insert(in_a_alone.end(), next_a, a.end());
    in_b_alone.insert(in_b_alone.end(), next_b, b.end());
}

/// Features in panels of eight features, one column a row.
void gather_columns(const MatrixXd& by_row, std::span<const Index> rows, PanelMatrix& out) {
    out.resize(static_cast<std::size_t>(by_row.rows()), rows.size());
    for (std::size_t v = 0; v < rows.size(); ++v) {
        const double* const features = by_row.col(rows[v]).data();
        for (std::size_t p = 0; p < out.panels(); ++p) {
            std::memcpy(out.eight(p, v), features + p * height, height * sizeof(double));
        }
    }
}

/// Features in panels of eight rows, one column a feature.
void gather_rows(const MatrixXd& by_row, std::span<const Index> rows, PanelMatrix& out) {
    const auto rank = static_cast<std::size_t>(by_row.rows());
    out.resize(rows.size(), rank);
    for (std::size_t p = 0; p < out.panels(); ++p) {
        const std::size_t first = p * height;
        const std::size_t here = std::min(height, rows.size() - first);
        double* const panel = out.panel(p);
        if (here < height) std::fill_n(panel, rank * height, 0.0);
        for (std::size_t lane = 0; lane < here; ++lane) {
            const double* const features = by_row.col(rows[first + lane]).data();
            for (std::size_t f = 0; f < rank; ++f) panel[f * height + lane] = features[f];
        }
    }
}

/// scale * gram - weight * mean mean' + I, the lower triangle.
void assemble(const PanelMatrix& gram, double scale, double weight, const VectorXd& mean,
              PanelMatrix& system) {
    system.resize_lower(gram.padded_rows());
    for (std::size_t p = 0; p < gram.panels(); ++p) {
        const double* const here = mean.data() + p * height;
        const double* const from = gram.panel(p);
        double* const to = system.panel(p);
        for (std::size_t j = 0; j < (p + 1) * height; ++j) {
            const double factor = weight * mean.data()[j];
            for (std::size_t lane = 0; lane < height; ++lane) {
                to[j * height + lane] = scale * from[j * height + lane] - factor * here[lane];
            }
        }
    }
    for (std::size_t i = 0; i < system.padded_rows(); ++i) system.at(i, i) += 1.0;
}

}  // namespace

const PanelMatrix& FeatureGram::over(const MatrixXd& by_row, const std::vector<Index>& bending) {
    const auto all = static_cast<std::size_t>(by_row.cols());
    differences(bending, rows_, entering_, leaving_);
    const std::size_t changed = entering_.size() + leaving_.size();
    const std::size_t from_anew = std::min(bending.size(), all - bending.size());
    if (changed > from_anew || changes_ == most_changes || sum_.numbers() == 0) {
        if (2 * bending.size() > all) {
            start_from_all(by_row);
        } else {
            start_from_nothing(static_cast<std::size_t>(by_row.rows()));
        }
        differences(bending, rows_, entering_, leaving_);
        changes_ = 0;
    }
    add(by_row, entering_, 1.0, sum_);
    add(by_row, leaving_, -1.0, sum_);
    rows_ = bending;
    ++changes_;
    return sum_;
}

void FeatureGram::start_from_nothing(std::size_t rank) {
    sum_.set_zero_lower(rank);
    rows_.clear();
}

void FeatureGram::start_from_all(const MatrixXd& by_row) {
    const auto rank = static_cast<std::size_t>(by_row.rows());
    rows_.resize(static_cast<std::size_t>(by_row.cols()));
    std::iota(rows_.begin(), rows_.end(), Index{0});
    if (sum_of_all_.numbers() == 0) {
        sum_of_all_.set_zero_lower(rank);
        add(by_row, rows_, 1.0, sum_of_all_);
    }
    sum_ = sum_of_all_;
}

void FeatureGram::add(const MatrixXd& by_row, const std::vector<Index>& rows, double sign, PanelMatrix& sum) {
    const std::span<const Index> all = rows;
    for (std::size_t first = 0; first < all.size(); first += gathered_at_once) {
        gather_columns(by_row, all.subspan(first, std::min(gathered_at_once, all.size() - first)), gathered_);
        add_products(gathered_, sign, sum);
    }
}

void RowGram::over(const MatrixXd& by_row, const std::vector<Index>& bending, PanelMatrix& out) {
    const auto all = static_cast<std::size_t>(by_row.cols());
    if (all > most_rows_multiplied_once) {
        follow(by_row, bending);
        out = products_;
        return;
    }
    if (of_all_.size() == 0 && is_all_cheaper_by_now(bending.size(), all)) multiply_all(by_row);
    if (of_all_.size() > 0) {
        pick_lower(of_all_.data(), all, bending, out);
    } else {
        multiply(by_row, bending, out);
    }
}

/// As long as the few products were cheaper together than all would have been, they go on being made anew:
/// that never costs more than twice what the better choice would have cost.
bool RowGram::is_all_cheaper_by_now(std::size_t bending, std::size_t all) {
    const auto blocks = [](std::size_t rows) {
        const std::size_t panels = (rows + height - 1) / height;
        return panels * (panels + 1) / 2;
    };
    blocks_made_ += blocks(bending) + 1;
    return blocks_made_ > blocks(all);
}

void RowGram::multiply(const MatrixXd& by_row, const std::vector<Index>& bending, PanelMatrix& out) {
    gather_rows(by_row, bending, all_by_row_);
    out.set_zero_lower(bending.size());
    add_products(all_by_row_, 1.0, out);
}

void RowGram::follow(const MatrixXd& by_row, const std::vector<Index>& bending) {
    find_kept_and_fresh(bending);
    if (fresh_.empty() && kept_.size() == rows_.size()) return;
    if (2 * fresh_.size() > bending.size()) {
        multiply(by_row, bending, products_);
    } else {
        if (!fresh_.empty()) gather_rows(by_row, bending, all_by_row_);
        bring_up_to_date(by_row, bending);
    }
    rows_ = bending;
}

void RowGram::multiply_all(const MatrixXd& by_row) {
    std::vector<Index> rows(static_cast<std::size_t>(by_row.cols()));
    std::iota(rows.begin(), rows.end(), Index{0});
    gather_rows(by_row, rows, all_by_row_);
    PanelMatrix lower;
    lower.set_zero_lower(rows.size());
    add_products(all_by_row_, 1.0, lower);
    of_all_.setZero(by_row.cols(), by_row.cols());
    for (std::size_t p = 0; p < lower.panels(); ++p) {
        const std::size_t first = p * height;
        const std::size_t here = std::min(height, rows.size() - first);
        for (std::size_t j = 0; j < first + here; ++j) {
            std::memcpy(of_all_.col(static_cast<Index>(j)).data() + first, lower.eight(p, j),
                        here * sizeof(double));
        }
    }
}

void RowGram::find_kept_and_fresh(const std::vector<Index>& bending) {
    kept_.clear();
    fresh_.clear();
    auto old = rows_.begin();
    for (std::size_t k = 0; k < bending.size(); ++k) {
        while (old != rows_.end() && *old < bending[k]) ++old;
        if (old != rows_.end() && *old == bending[k]) {
            kept_.emplace_back(k, static_cast<std::size_t>(old - rows_.begin()));
        } else {
            fresh_.push_back(k);
        }
    }
}

void RowGram::bring_up_to_date(const MatrixXd& by_row, const std::vector<Index>& bending) {
    new_products_.set_zero_lower(bending.size());
    for (std::size_t r = 0; r < kept_.size(); ++r) {
        for (std::size_t c = 0; c <= r; ++c) {
            new_products_.at(kept_[r].first, kept_[c].first) = products_.at(kept_[r].second, kept_[c].second);
        }
    }
    std::swap(products_, new_products_);
    if (fresh_.empty()) return;
    fresh_rows_.clear();
    for (const std::size_t k : fresh_) fresh_rows_.push_back(bending[k]);
    gather_rows(by_row, fresh_rows_, fresh_by_row_);
    products(all_by_row_, fresh_by_row_, of_fresh_);
    for (std::size_t f = 0; f < fresh_.size(); ++f) {
        for (std::size_t i = 0; i < bending.size(); ++i) {
            products_.at(std::max(i, fresh_[f]), std::min(i, fresh_[f])) = of_fresh_.at(i, f);
        }
    }
}

void NewtonSystem::solve(const std::vector<Index>& bending, double curvature, const VectorXd& gradient,
                         double bias_gradient, Direction& direction) {
    if (static_cast<Index>(bending.size()) > by_row_.rows()) {
        in_feature_space(bending, curvature, gradient, bias_gradient, direction);
    } else {
        in_row_space(bending, curvature, gradient, bias_gradient, direction);
    }
}

void NewtonSystem::in_feature_space(const std::vector<Index>& bending, double curvature,
                                    const VectorXd& gradient, double bias_gradient, Direction& direction) {
    const auto rows = static_cast<double>(bending.size());
    mean_.setZero(by_row_.rows());
    shares_.assign(bending.size(), 1.0 / rows);
    vector_loops::add_rows(by_row_.data(), static_cast<std::size_t>(by_row_.rows()), bending, shares_,
                           mean_.data());
    assemble(feature_gram_.over(by_row_, bending), curvature, curvature * rows, mean_, system_);
    factor_.factor(system_);
    direction.weights = mean_ * bias_gradient - gradient;
    factor_.solve(direction.weights.data());
    direction.bias = -bias_gradient / (curvature * rows) - mean_.dot(direction.weights);
}

void NewtonSystem::in_row_space(const std::vector<Index>& bending, double curvature, const VectorXd& gradient,
                                double bias_gradient, Direction& direction) {
    const auto rank = static_cast<std::size_t>(by_row_.rows());
    const auto rows = static_cast<Index>(bending.size());
    row_gram_.over(by_row_, bending, system_);
    for (std::size_t i = 0; i < system_.padded_rows(); ++i) system_.at(i, i) += 1.0 / curvature;
    factor_.factor(system_);
    without_bias_.setZero(static_cast<Index>(system_.padded_rows()));
    vector_loops::multiply_rows(by_row_.data(), rank, bending, gradient.data(), 0.0, without_bias_.data());
    without_bias_ *= -1.0;
    factor_.solve_lower(without_bias_.data());
    of_bias_.setZero(without_bias_.size());
    of_bias_.head(rows).setOnes();
    factor_.solve_lower(of_bias_.data());
    direction.bias = (-bias_gradient - of_bias_.dot(without_bias_)) / of_bias_.squaredNorm();
    without_bias_ = -without_bias_ - direction.bias * of_bias_;
    factor_.solve_upper(without_bias_.data());
    direction.weights = -gradient;
    vector_loops::add_rows(by_row_.data(), rank, bending, {without_bias_.data(), bending.size()},
                           direction.weights.data());
}

std::size_t NewtonSystem::kept_numbers() const {
    return feature_gram_.kept_numbers() + row_gram_.kept_numbers() + system_.numbers();
}

}  // namespace thermbal
