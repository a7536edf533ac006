#pragma once

#include <cstddef>
#include <vector>

namespace thermbal {

/// A matrix cut into panels of eight rows, the last one padded with rows of zeros: the eight elements of one
/// column of a panel lie side by side, as the vector units want them. Of a symmetric matrix only the lower
/// triangle may be kept: each panel then ends with its eight columns on the diagonal, and what lies above the
/// diagonal in these is not defined.
class PanelMatrix {
  public:
    static constexpr std::size_t height = 8;

    /// All zeros.
    void set_zero(std::size_t rows, std::size_t columns);
    void set_zero_lower(std::size_t rows);
    /// Elements not defined.
    void resize(std::size_t rows, std::size_t columns);
    void resize_lower(std::size_t rows);

    std::size_t panels() const { return panels_; }
    std::size_t padded_rows() const { return panels_ * height; }
    std::size_t columns() const { return columns_; }
    std::size_t numbers() const { return elements_.size(); }

    double* panel(std::size_t p) { return elements_.data() + begin_of(p); }
    const double* panel(std::size_t p) const { return elements_.data() + begin_of(p); }
    /// The eight elements of column j in panel p.
    double* eight(std::size_t p, std::size_t j) { return panel(p) + j * height; }
    const double* eight(std::size_t p, std::size_t j) const { return panel(p) + j * height; }
    double& at(std::size_t i, std::size_t j) { return eight(i / height, j)[i % height]; }
    double at(std::size_t i, std::size_t j) const { return eight(i / height, j)[i % height]; }

  private:
    std::size_t begin_of(std::size_t p) const {
        return is_lower_ ? p * (p + 1) / 2 * height * height : p * columns_ * height;
    }
    void make(std::size_t rows, std::size_t columns, bool is_lower);

    bool is_lower_ = false;
    std::size_t panels_ = 0;
    std::size_t columns_ = 0;
    std::vector<double> elements_;
};

/// The lower triangle of these rows and columns of a symmetric matrix (column-major, a column every `stride`
/// numbers), zeros in the padding. REQUIRES: at least one row.
void pick_lower(const double* symmetric, std::size_t stride, const std::vector<std::ptrdiff_t>& rows,
                PanelMatrix& out);

/// lower += sign * V V', its lower triangle. REQUIRES: lower square, of V's padded rows.
void add_products(const PanelMatrix& V, double sign, PanelMatrix& lower);

/// out = V W', for V and W of equally many columns.
void products(const PanelMatrix& V, const PanelMatrix& W, PanelMatrix& out);

/// Cholesky's factorisation of a positive definite matrix (lower triangle, square, padded: with a positive
/// diagonal in the padding) and its solutions. Same bits on every processor. One object a thread.
class PanelCholesky {
  public:
    /// In place; `lower` must live as long as solutions are asked for.
    void factor(PanelMatrix& lower);
    /// x = A^-1 x, padded_rows() numbers.
    void solve(double* x);
    /// Its two halves: x = L^-1 x and x = L'^-1 x, where A = L L'.
    void solve_lower(double* x) const;
    void solve_upper(double* x);

  private:
    PanelMatrix* lower_ = nullptr;
    std::vector<double> inverse_diagonal_;
    std::vector<double> pending_;
};

}  // namespace thermbal
