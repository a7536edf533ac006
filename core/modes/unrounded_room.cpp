#include "unrounded_room.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <Eigen/SparseCholesky>

#include "base/units.hpp"
#include "series/resolution.hpp"
#include "series/sample.hpp"

namespace thermbal {

namespace {

// Everything here is in steps of the readings.

constexpr double knot_min = 3.0;
/// Standard deviation of the change of slope from knot to knot. On 20 rooms of a finite-volume machine and 8
/// sums of waves, means of 15 min were nearest to the truth with this and the least noise below; with half or
/// twice as much they are hardly further off.
constexpr double bend = 0.02;
/// Tried from the widest on; each starts where the last one ended.
constexpr std::array<double, 5> sensor_noises = {0.45, 0.33, 0.24, 0.17, 0.12};
/// So near, and so many readings that no noise explains: the curve does not hold there.
constexpr std::size_t near_knots = 4;
constexpr double most_unexplained = 0.1;
constexpr double rounding_variance = 1.0 / 12.0;

struct Likelihood {
    double log = 0.0;
    double slope = 0.0;
    double curvature = 0.0;  ///< of minus the logarithm, not below 0
};

/// Of a reading `away` above the curve.
Likelihood of_reading(double away, double noise) {
    // Some readings no curve explains: none pulls without bound.
    constexpr double unexplained = 1e-3;
    const double side = away < 0.0 ? -1.0 : 1.0;
    const double near = (std::abs(away) - 0.5) / noise;
    const double far = (std::abs(away) + 0.5) / noise;
    const auto above = [](double z) { return 0.5 * std::erfc(z / std::numbers::sqrt2); };
    const auto density = [](double z) {
        return std::exp(-0.5 * z * z) * std::numbers::inv_sqrtpi / std::numbers::sqrt2;
    };
    const double probability = above(near) - above(far) + unexplained;
    const double first = side * (density(near) - density(far)) / (noise * probability);
    const double second = (near * density(near) - far * density(far)) / (noise * noise * probability);
    return {std::log(probability), first, std::max(0.0, first * first - second)};
}

/// Where a scan lies between two knots.
struct Place {
    Eigen::Index knot = 0;
    double share = 0.0;  ///< of the next knot

    double at(const Eigen::VectorXd& level) const {
        return (1.0 - share) * level[knot] + share * level[knot + 1];
    }
};

/// The levels at the knots, straight in between, given the readings.
class Drift {
  public:
    Drift(const std::vector<double>& readings, std::size_t scans_per_knot)
        : readings_(readings), per_knot_(static_cast<double>(scans_per_knot)) {
        const std::size_t knots = (readings.size() + scans_per_knot - 1) / scans_per_knot + 1;
        const auto count = static_cast<Eigen::Index>(knots);
        Eigen::SparseMatrix<double> bends(count - 2, count);
        for (Eigen::Index k = 0; k + 2 < count; ++k) {
            bends.insert(k, k) = 1.0 / bend;
            bends.insert(k, k + 1) = -2.0 / bend;
            bends.insert(k, k + 2) = 1.0 / bend;
        }
        // Level and slope are free, but for what keeps the system definite.
        constexpr double loose = 1e-4;
        prior_.resize(count, count);
        prior_.setIdentity();
        prior_ *= loose;
        prior_ += Eigen::SparseMatrix<double>(bends.transpose()) * bends;
    }

    Eigen::VectorXd by_least_squares() const {
        const Eigen::VectorXd zero = Eigen::VectorXd::Zero(prior_.rows());
        return newton_step(zero, [](double away) {
            return Likelihood{0.0, away / rounding_variance, 1.0 / rounding_variance};
        });
    }

    /// Newton's method from `level` on, which ends at the mode; the logarithm of the posterior there.
    double climb(double noise, Eigen::VectorXd& level) const {
        constexpr int most_steps = 12;
        constexpr double shortest = 0.05;
        constexpr double enough = 1e-3;
        double best = value(level, noise);
        for (int step = 0; step < most_steps; ++step) {
            const Eigen::VectorXd move =
                newton_step(level, [noise](double away) { return of_reading(away, noise); });
            double length = 1.0;
            double reached = value(level + move, noise);
            while (!(reached > best) && length > shortest) {
                length *= 0.5;
                reached = value(level + length * move, noise);
            }
            if (!(reached > best)) break;
            level += length * move;
            const double gained = reached - best;
            best = reached;
            if (gained < enough) break;
        }
        return best;
    }

    Place place_of(std::size_t scan) const {
        const double position = static_cast<double>(scan) / per_knot_;
        const auto knot = std::min(static_cast<Eigen::Index>(position), prior_.rows() - 2);
        return {knot, position - static_cast<double>(knot)};
    }

  private:
    double value(const Eigen::VectorXd& level, double noise) const {
        double sum = -0.5 * level.dot(prior_ * level);
        for (std::size_t k = 0; k < readings_.size(); ++k) {
            if (!std::isnan(readings_[k])) sum += of_reading(readings_[k] - place_of(k).at(level), noise).log;
        }
        return sum;
    }

    template <class OfReading>
    Eigen::VectorXd newton_step(const Eigen::VectorXd& level, const OfReading& likelihood) const {
        Eigen::VectorXd gradient = -(prior_ * level);
        Eigen::SparseMatrix<double> hessian = prior_;
        for (std::size_t k = 0; k < readings_.size(); ++k) {
            if (std::isnan(readings_[k])) continue;
            const Place place = place_of(k);
            const Likelihood one = likelihood(readings_[k] - place.at(level));
            const std::array<double, 2> weight = {1.0 - place.share, place.share};
            for (Eigen::Index i = 0; i < 2; ++i) {
                const double of_knot = weight[static_cast<std::size_t>(i)];
                gradient[place.knot + i] += of_knot * one.slope;
                for (Eigen::Index j = 0; j < 2; ++j) {
                    hessian.coeffRef(place.knot + i, place.knot + j) +=
                        of_knot * weight[static_cast<std::size_t>(j)] * one.curvature;
                }
            }
        }
        return Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>(hessian).solve(gradient);
    }

    const std::vector<double>& readings_;
    double per_knot_;
    Eigen::SparseMatrix<double> prior_;
};

/// Consecutive readings differ by more than rounding and a noise of half a step explain.
bool noisy(const std::vector<double>& readings) {
    double squares = 0.0;
    std::size_t count = 0;
    for (std::size_t k = 1; k < readings.size(); ++k) {
        const double difference = readings[k] - readings[k - 1];
        if (std::isnan(difference)) continue;
        squares += difference * difference;
        ++count;
    }
    return squares > 2.0 * (0.25 + rounding_variance) * static_cast<double>(count);
}

/// A door or a thermostat moves the room faster than the curve bends: there readings stay what they are.
bool mostly_explained_about(std::size_t scan, const std::vector<double>& readings,
                            const std::vector<bool>& explained, std::size_t reach) {
    if (!explained[scan]) return false;
    std::size_t good = 0;
    std::size_t missed = 0;
    const std::size_t last = std::min(explained.size(), scan + reach + 1);
    for (std::size_t k = scan - std::min(scan, reach); k < last; ++k) {
        if (std::isnan(readings[k])) continue;
        ++good;
        if (!explained[k]) ++missed;
    }
    return static_cast<double>(missed) <= most_unexplained * static_cast<double>(good);
}

}  // namespace

std::optional<std::vector<double>> unrounded_room(const std::vector<double>& values, double period_s) {
    const double step_C = smallest_step(values);
    const double centre_C = mean_of_good(values);
    const auto per_knot =
        static_cast<std::size_t>(std::max(1L, std::lround(knot_min * seconds_per_min / period_s)));
    if (!(step_C > 0.0) || values.size() < 3 * per_knot) return std::nullopt;
    std::vector<double> readings;
    readings.reserve(values.size());
    for (const double value : values) readings.push_back((value - centre_C) / step_C);
    if (noisy(readings)) return std::nullopt;

    const Drift drift(readings, per_knot);
    Eigen::VectorXd level = drift.by_least_squares();
    Eigen::VectorXd likeliest;
    double noise = 0.0;
    double best = 0.0;
    for (const double tried : sensor_noises) {
        const double reached = drift.climb(tried, level);
        if (noise > 0.0 && reached <= best) break;
        best = reached;
        noise = tried;
        likeliest = level;
    }
    if (noise == sensor_noises.front()) return std::nullopt;

    std::vector<double> curve;
    std::vector<bool> explained;
    for (std::size_t k = 0; k < readings.size(); ++k) {
        curve.push_back(drift.place_of(k).at(likeliest));
        // No number is within reach of a gap.
        explained.push_back(std::abs(curve[k] - readings[k]) <= 0.5 + 2.0 * noise);
    }
    std::vector<double> unrounded = values;
    for (std::size_t k = 0; k < values.size(); ++k) {
        if (mostly_explained_about(k, readings, explained, near_knots * per_knot))
            unrounded[k] = centre_C + step_C * curve[k];
    }
    return unrounded;
}

}  // namespace thermbal
