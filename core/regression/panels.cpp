#include "regression/panels.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "base/every_width.hpp"

namespace thermbal {
namespace {

constexpr std::size_t height = PanelMatrix::height;

using TwoLanes [[gnu::vector_size(16)]] = double;
using FourLanes [[gnu::vector_size(32)]] = double;
using EightLanes [[gnu::vector_size(64)]] = double;

/// block(lane, c) += sign * sum over v of a(lane, v) b(c, v), eight lanes, `columns` columns at a time: as
/// many sums as fit into the registers. Every element is summed up in the order of v, whatever the width.
template <typename Vector, std::size_t columns>
[[gnu::always_inline]] inline void add_block_by(const double* a, const double* b, std::size_t depth,
                                                double sign, double* block) {
    constexpr std::size_t width = sizeof(Vector) / sizeof(double);
    constexpr std::size_t vectors = height / width;
    for (std::size_t first = 0; first < height; first += columns) {
        std::array<std::array<Vector, vectors>, columns> sums{};
        for (std::size_t v = 0; v < depth; ++v) {
            for (std::size_t k = 0; k < vectors; ++k) {
                Vector of_a;
                std::memcpy(&of_a, a + v * height + k * width, sizeof of_a);
                for (std::size_t c = 0; c < columns; ++c) sums[c][k] += of_a * b[v * height + first + c];
            }
        }
        for (std::size_t c = 0; c < columns; ++c) {
            for (std::size_t k = 0; k < vectors; ++k) {
                double* const out = block + (first + c) * height + k * width;
                Vector sum;
                std::memcpy(&sum, out, sizeof sum);
                sum += sign * sums[c][k];
                std::memcpy(out, &sum, sizeof sum);
            }
        }
    }
}

#ifdef THERMBAL_WIDTHS_OF_X86
__attribute__((target("avx512f"))) void add_block(const double* a, const double* b, std::size_t depth,
                                                  double sign, double* block) {
    add_block_by<EightLanes, 8>(a, b, depth, sign, block);
}
__attribute__((target("avx2"))) void add_block(const double* a, const double* b, std::size_t depth,
                                               double sign, double* block) {
    add_block_by<FourLanes, 4>(a, b, depth, sign, block);
}
__attribute__((target("default")))
#endif
void add_block(const double* a, const double* b, std::size_t depth, double sign, double* block) {
    add_block_by<TwoLanes, 2>(a, b, depth, sign, block);
}

/// Eight columns side by side, each in a register.
using Block = std::array<EightLanes, height>;

/// block = block * L'^-1, L the lower triangle of eight columns side by side.
THERMBAL_EVERY_WIDTH
void solve_block(const double* __restrict L, const double* __restrict inverse_diagonal,
                 double* __restrict block) {
    Block columns;
    std::memcpy(columns.data(), block, sizeof columns);
#pragma GCC unroll 8
    for (std::size_t c = 0; c < height; ++c) {
        columns[c] *= inverse_diagonal[c];
#pragma GCC unroll 8
        for (std::size_t d = c + 1; d < height; ++d) columns[d] -= L[c * height + d] * columns[c];
    }
    std::memcpy(block, columns.data(), sizeof columns);
}

/// The Cholesky factor of eight columns on the diagonal, in place. What lies above the diagonal goes along,
/// and nothing comes of it.
THERMBAL_EVERY_WIDTH
void factor_block(double* __restrict block, double* __restrict inverse_diagonal) {
    Block columns;
    std::memcpy(columns.data(), block, sizeof columns);
#pragma GCC unroll 8
    for (std::size_t c = 0; c < height; ++c) {
        inverse_diagonal[c] = 1.0 / std::sqrt(columns[c][c]);
        columns[c] *= inverse_diagonal[c];
#pragma GCC unroll 8
        for (std::size_t d = c + 1; d < height; ++d) columns[d] -= columns[c][d] * columns[c];
    }
    std::memcpy(block, columns.data(), sizeof columns);
}

/// out(lane) -= sum over j of panel(lane, j) x(j).
THERMBAL_EVERY_WIDTH
void subtract_product(const double* __restrict panel, std::size_t columns, const double* __restrict x,
                      double* __restrict out) {
    static_assert(height % 4 == 0);
    std::array<std::array<double, height>, 4> sums{};
    for (std::size_t j = 0; j < columns; j += 4) {
        for (std::size_t k = 0; k < 4; ++k) {
            for (std::size_t lane = 0; lane < height; ++lane) {
                sums[k][lane] += panel[(j + k) * height + lane] * x[j + k];
            }
        }
    }
    for (std::size_t lane = 0; lane < height; ++lane) {
        out[lane] -= (sums[0][lane] + sums[1][lane]) + (sums[2][lane] + sums[3][lane]);
    }
}

/// pending(lane, j) += panel(lane, j) x(lane).
THERMBAL_EVERY_WIDTH
void add_scaled(const double* __restrict panel, std::size_t columns, const double* __restrict x,
                double* __restrict pending) {
    for (std::size_t j = 0; j < columns; ++j) {
        for (std::size_t lane = 0; lane < height; ++lane) {
            pending[j * height + lane] += panel[j * height + lane] * x[lane];
        }
    }
}

}  // namespace

void PanelMatrix::make(std::size_t rows, std::size_t columns, bool is_lower) {
    is_lower_ = is_lower;
    panels_ = (rows + height - 1) / height;
    columns_ = columns;
    const std::size_t numbers = begin_of(panels_);
    if (numbers > elements_.capacity()) {
        // No more than that, and nothing copied.
        elements_ = {};
        elements_.reserve(numbers);
    }
    elements_.resize(numbers);
}

void PanelMatrix::resize(std::size_t rows, std::size_t columns) {
    make(rows, columns, false);
}

void PanelMatrix::resize_lower(std::size_t rows) {
    make(rows, (rows + height - 1) / height * height, true);
}

void PanelMatrix::set_zero(std::size_t rows, std::size_t columns) {
    resize(rows, columns);
    std::ranges::fill(elements_, 0.0);
}

void PanelMatrix::set_zero_lower(std::size_t rows) {
    resize_lower(rows);
    std::ranges::fill(elements_, 0.0);
}

void pick_lower(const double* symmetric, std::size_t stride, const std::vector<std::ptrdiff_t>& rows,
                PanelMatrix& out) {
    const std::size_t count = rows.size();
    out.resize_lower(count);
    for (std::size_t p = 0; p < out.panels(); ++p) {
        const std::size_t first = p * height;
        std::array<std::ptrdiff_t, height> of_lanes{};
        for (std::size_t lane = 0; lane < height; ++lane) {
            of_lanes[lane] = rows[std::min(first + lane, count - 1)];
        }
        for (std::size_t j = 0; j < std::min(first + height, count); ++j) {
            const double* const column = symmetric + static_cast<std::size_t>(rows[j]) * stride;
            double* const eight = out.eight(p, j);
            for (std::size_t lane = 0; lane < height; ++lane) eight[lane] = column[of_lanes[lane]];
        }
    }
    for (std::size_t i = count; i < out.padded_rows(); ++i) {
        for (std::size_t j = 0; j <= i; ++j) out.at(i, j) = 0.0;
    }
}

void add_products(const PanelMatrix& V, double sign, PanelMatrix& lower) {
    for (std::size_t p = 0; p < V.panels(); ++p) {
        for (std::size_t q = 0; q <= p; ++q) {
            add_block(V.panel(p), V.panel(q), V.columns(), sign, lower.eight(p, q * height));
        }
    }
}

void products(const PanelMatrix& V, const PanelMatrix& W, PanelMatrix& out) {
    out.set_zero(V.padded_rows(), W.padded_rows());
    for (std::size_t p = 0; p < V.panels(); ++p) {
        for (std::size_t q = 0; q < W.panels(); ++q) {
            add_block(V.panel(p), W.panel(q), V.columns(), 1.0, out.eight(p, q * height));
        }
    }
}

void PanelCholesky::factor(PanelMatrix& lower) {
    lower_ = &lower;
    inverse_diagonal_.resize(lower.padded_rows());
    for (std::size_t q = 0; q < lower.panels(); ++q) {
        const std::size_t done = q * height;
        for (std::size_t p = q; p < lower.panels(); ++p) {
            add_block(lower.panel(p), lower.panel(q), done, -1.0, lower.eight(p, done));
            if (p == q) {
                factor_block(lower.eight(q, done), inverse_diagonal_.data() + done);
            } else {
                solve_block(lower.eight(q, done), inverse_diagonal_.data() + done, lower.eight(p, done));
            }
        }
    }
}

void PanelCholesky::solve(double* x) {
    solve_lower(x);
    solve_upper(x);
}

void PanelCholesky::solve_lower(double* x) const {
    const PanelMatrix& lower = *lower_;
    for (std::size_t p = 0; p < lower.panels(); ++p) {
        const std::size_t first = p * height;
        const double* const block = lower.eight(p, first);
        subtract_product(lower.panel(p), first, x, x + first);
        for (std::size_t c = 0; c < height; ++c) {
            x[first + c] *= inverse_diagonal_[first + c];
            for (std::size_t i = c + 1; i < height; ++i) x[first + i] -= block[c * height + i] * x[first + c];
        }
    }
}

void PanelCholesky::solve_upper(double* x) {
    const PanelMatrix& lower = *lower_;
    pending_.assign(lower.padded_rows() * height, 0.0);
    for (std::size_t p = lower.panels(); p-- > 0;) {
        const std::size_t first = p * height;
        const double* const block = lower.eight(p, first);
        for (std::size_t c = height; c-- > 0;) {
            const double* const sums = pending_.data() + (first + c) * height;
            double value = x[first + c];
            for (std::size_t lane = 0; lane < height; ++lane) value -= sums[lane];
            for (std::size_t i = c + 1; i < height; ++i) value -= block[c * height + i] * x[first + i];
            x[first + c] = value * inverse_diagonal_[first + c];
        }
        add_scaled(lower.panel(p), first, x + first, pending_.data());
    }
}

}  // namespace thermbal
