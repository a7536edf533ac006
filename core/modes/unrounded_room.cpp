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

/// That a reading lies `away` above the curve.
double probability_of(double away, double noise) {
    // Some readings no curve explains: none pulls without bound.
    constexpr double unexplained = 1e-3;
    const auto above = [](double z) { return 0.5 * std::erfc(z / std::numbers::sqrt2); };
    return above((std::abs(away) - 0.5) / noise) - above((std::abs(away) + 0.5) / noise) + unexplained;
}

/// Of a logarithm of a probability, by the curve.
struct Derivatives {
    double slope = 0.0;
    double curvature = 0.0;  ///< its negative, not below 0
};

Derivatives derivatives_of(double away, double noise) {
    const double side = away < 0.0 ? -1.0 : 1.0;
    const double near = (std::abs(away) - 0.5) / noise;
    const double far = (std::abs(away) + 0.5) / noise;
    const auto density = [](double z) {
        return std::exp(-0.5 * z * z) * std::numbers::inv_sqrtpi / std::numbers::sqrt2;
    };
    const double probability = probability_of(away, noise);
    const double first = side * (density(near) - density(far)) / (noise * probability);
    const double second = (near * density(near) - far * density(far)) / (noise * noise * probability);
    return {first, std::max(0.0, first * first - second)};
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
        return newton_step(
            zero, [](double away) { return Derivatives{away / rounding_variance, 1.0 / rounding_variance}; });
    }

    /// Newton's method from `level` on, which ends at the mode; the logarithm of the posterior there.
    double climb(double noise, Eigen::VectorXd& level) const {
        constexpr int most_steps = 12;
        constexpr double shortest = 0.05;
        constexpr double enough = 1e-3;
        double best = value(level, noise);
        for (int step = 0; step < most_steps; ++step) {
            const Eigen::VectorXd move =
                newton_step(level, [noise](double away) { return derivatives_of(away, noise); });
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
            if (!std::isnan(readings_[k]))
                sum += std::log(probability_of(readings_[k] - place_of(k).at(level), noise));
        }
        return sum;
    }

    template <class OfReading>
    Eigen::VectorXd newton_step(const Eigen::VectorXd& level, const OfReading& derivatives) const {
        Eigen::VectorXd gradient = -(prior_ * level);
        Eigen::SparseMatrix<double> hessian = prior_;
        for (std::size_t k = 0; k < readings_.size(); ++k) {
            if (std::isnan(readings_[k])) continue;
            const Place place = place_of(k);
            const Derivatives one = derivatives(readings_[k] - place.at(level));
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

/// Where no more than `most_unexplained` of the good readings up to `reach` scans away are unexplained. A
/// door or a thermostat moves the room faster than the curve bends: there readings stay what they are.
std::vector<bool> mostly_explained(const std::vector<double>& readings, const std::vector<bool>& explained,
                                   std::size_t reach) {
    std::vector<std::size_t> good_before{0};
    std::vector<std::size_t> missed_before{0};
    for (std::size_t k = 0; k < readings.size(); ++k) {
        const bool is_good = !std::isnan(readings[k]);
        good_before.push_back(good_before.back() + (is_good ? 1 : 0));
        missed_before.push_back(missed_before.back() + (is_good && !explained[k] ? 1 : 0));
    }
    std::vector<bool> mostly;
    for (std::size_t k = 0; k < readings.size(); ++k) {
        const std::size_t first = k - std::min(k, reach);
        const std::size_t end = std::min(readings.size(), k + reach + 1);
        const auto good = static_cast<double>(good_before[end] - good_before[first]);
        const auto missed = static_cast<double>(missed_before[end] - missed_before[first]);
        mostly.push_back(explained[k] && missed <= most_unexplained * good);
    }
    return mostly;
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
    const std::vector<bool> taken = mostly_explained(readings, explained, near_knots * per_knot);
    std::vector<double> unrounded = values;
    for (std::size_t k = 0; k < values.size(); ++k) {
        if (taken[k]) unrounded[k] = centre_C + step_C * curve[k];
    }
    return unrounded;
}

}  // namespace thermbal
