#include <cstddef>
#include <cstring>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include "regression/vector_loops.hpp"

namespace thermbal::test {
namespace {

/// Numbers that end where a page begins that nobody may touch: reading or writing one further is a
/// segmentation fault. AddressSanitizer sees none of it, because under it the loops are not compiled for wide
/// vectors.
class AtTheEdge {
  public:
    explicit AtTheEdge(std::size_t count) {
        const auto page = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
        const std::size_t bytes = count * sizeof(double);
        const std::size_t pages = (bytes + page - 1) / page;
        length_ = (pages + 1) * page;
        mapped_ = mmap(nullptr, length_, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
        if (mapped_ == MAP_FAILED) std::abort();
        auto* const bytes_mapped = static_cast<std::byte*>(mapped_);
        if (mprotect(bytes_mapped + pages * page, page, PROT_NONE) != 0) std::abort();
        data_ = reinterpret_cast<double*>(bytes_mapped + pages * page - bytes);
        for (std::size_t i = 0; i < count; ++i) data_[i] = 0.25 + 0.001 * static_cast<double>(i % 97);
    }
    ~AtTheEdge() { munmap(mapped_, length_); }
    AtTheEdge(const AtTheEdge&) = delete;
    AtTheEdge& operator=(const AtTheEdge&) = delete;

    double* data() { return data_; }

  private:
    void* mapped_ = nullptr;
    std::size_t length_ = 0;
    double* data_ = nullptr;
};

TEST(VectorLoops, ReadAndWriteNothingBeyondTheirArrays) {
    for (const std::size_t rows : {8U, 16U, 24U, 40U, 64U, 128U}) {
        for (const std::size_t count : {1U, 2U, 3U, 4U, 5U, 7U, 8U, 13U, 35U, 90U}) {
            AtTheEdge matrix(rows * count), column(rows), weight(rows), lags(count);
            std::vector<std::ptrdiff_t> all(count);
            std::iota(all.begin(), all.end(), std::ptrdiff_t{0});
            vector_loops::multiply_rows(matrix.data(), rows, all, weight.data(), 0.5, lags.data());
            vector_loops::add_rows(matrix.data(), rows, all, {lags.data(), count}, column.data());
            std::vector<const double*> lagged(count);
            for (std::size_t l = 0; l < count; ++l) lagged[l] = matrix.data() + l * rows;
            vector_loops::subtract_columns(lagged.data(), rows, count, lags.data(), column.data());
            vector_loops::squared_distances_to(lagged.data(), rows, lags.data(), count, column.data());
            (void)vector_loops::weighted_gaussians(matrix.data(), rows, weight.data(), lags.data(), count,
                                                   -0.5);
            const vector_loops::Tube tube{};
            AtTheEdge some(count), other(count);
            vector_loops::scaled_exp(some.data(), count, -1.0);
            vector_loops::loss_slopes(some.data(), count, tube, other.data());
            (void)vector_loops::derivatives_along(some.data(), other.data(), 0.1, count, tube);
        }
    }
}

}  // namespace
}  // namespace thermbal::test
