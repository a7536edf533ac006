#include "regression/bending_gram.hpp"

#include <algorithm>
#include <iterator>
#include <numeric>

#include "regression/vector_loops.hpp"

namespace thermbal {

using Eigen::Index;
using Eigen::MatrixXd;

namespace {

/// Every change leaves a rounding behind.
constexpr int most_changes = 64;

Index padded(Index count) {
    return static_cast<Index>(vector_loops::padded(static_cast<std::size_t>(count)));
}

void add_outer_products(const MatrixXd& vectors, double sign, MatrixXd& lower) {
    vector_loops::add_outer_products(vectors.data(), static_cast<std::size_t>(vectors.rows()),
                                     static_cast<std::size_t>(vectors.cols()), sign, lower.data());
}

std::vector<Index> all_rows(Index count) {
    std::vector<Index> rows(static_cast<std::size_t>(count));
    std::iota(rows.begin(), rows.end(), Index{0});
    return rows;
}

void difference(const std::vector<Index>& of, const std::vector<Index>& without, std::vector<Index>& out) {
    out.clear();
    std::ranges::set_difference(of, without, std::back_inserter(out));
}

}  // namespace

const MatrixXd& FeatureGram::over(const MatrixXd& by_row, const std::vector<Index>& bending) {
    const auto all = static_cast<std::size_t>(by_row.cols());
    difference(bending, rows_, entering_);
    difference(rows_, bending, leaving_);
    const std::size_t changed = entering_.size() + leaving_.size();
    const std::size_t from_anew = std::min(bending.size(), all - bending.size());
    if (changed > from_anew || changes_ == most_changes || sum_.size() == 0) {
        if (2 * bending.size() > all) {
            start_from_all(by_row);
        } else {
            start_from_nothing(padded(by_row.rows()));
        }
        difference(bending, rows_, entering_);
        difference(rows_, bending, leaving_);
        changes_ = 0;
    }
    add(by_row, entering_, 1.0, sum_);
    add(by_row, leaving_, -1.0, sum_);
    rows_ = bending;
    ++changes_;
    return sum_;
}

void FeatureGram::start_from_nothing(Index padded_rank) {
    sum_.setZero(padded_rank, padded_rank);
    rows_.clear();
}

void FeatureGram::start_from_all(const MatrixXd& by_row) {
    rows_ = all_rows(by_row.cols());
    if (sum_of_all_.size() == 0) {
        sum_of_all_.setZero(padded(by_row.rows()), padded(by_row.rows()));
        add(by_row, rows_, 1.0, sum_of_all_);
    }
    sum_ = sum_of_all_;
}

void FeatureGram::add(const MatrixXd& by_row, const std::vector<Index>& rows, double sign, MatrixXd& sum) {
    if (rows.empty()) return;
    gathered_.setZero(sum.rows(), static_cast<Index>(rows.size()));
    for (Index k = 0; k < gathered_.cols(); ++k) {
        gathered_.col(k).head(by_row.rows()) = by_row.col(rows[static_cast<std::size_t>(k)]);
    }
    add_outer_products(gathered_, sign, sum);
}

const MatrixXd& RowGram::over(const Eigen::Ref<const MatrixXd>& bent, const std::vector<Index>& bending) {
    kept_.clear();
    fresh_.clear();
    auto old = rows_.begin();
    for (Index k = 0; k < bent.cols(); ++k) {
        const Index row = bending[static_cast<std::size_t>(k)];
        while (old != rows_.end() && *old < row) ++old;
        if (old != rows_.end() && *old == row) {
            kept_.emplace_back(k, static_cast<Index>(old - rows_.begin()));
        } else {
            fresh_.push_back(k);
        }
    }
    if (2 * fresh_.size() > bending.size()) {
        make_anew(bent);
    } else {
        bring_up_to_date(bent);
    }
    rows_ = bending;
    return products_;
}

void RowGram::make_anew(const Eigen::Ref<const MatrixXd>& bent) {
    const Index rows = bent.cols();
    by_feature_.setZero(padded(rows), bent.rows());
    by_feature_.topRows(rows) = bent.transpose();
    new_products_.setZero(padded(rows), padded(rows));
    add_outer_products(by_feature_, 1.0, new_products_);
    products_ = new_products_.topLeftCorner(rows, rows);
}

void RowGram::bring_up_to_date(const Eigen::Ref<const MatrixXd>& bent) {
    const Index rows = bent.cols();
    new_products_.resize(rows, rows);
    for (const auto& [column, old_column] : kept_) {
        for (const auto& [row, old_row] : kept_) {
            if (row >= column) new_products_(row, column) = products_(old_row, old_column);
        }
    }
    for (const Index k : fresh_) {
        const Eigen::VectorXd products = bent.transpose() * bent.col(k);
        new_products_.row(k).head(k + 1) = products.head(k + 1).transpose();
        new_products_.col(k).tail(rows - k) = products.tail(rows - k);
    }
    std::swap(products_, new_products_);
}

}  // namespace thermbal
