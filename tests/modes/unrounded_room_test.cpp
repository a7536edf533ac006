#include "unrounded_room.hpp"

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include <gmock/gmock.h>

#include "series/sample.hpp"

namespace thermbal {
namespace {

constexpr double period_s = 15.0;
constexpr double step_C = 0.1;
constexpr std::size_t scans = 1200;
constexpr std::size_t quarter_hour = 60;

/// A hall over five hours: two slow waves that no straight line follows, by some tenths of a degree.
std::vector<double> hall(double phase) {
    std::vector<double> temperature_C;
    for (std::size_t k = 0; k < scans; ++k) {
        const double turn = 2.0 * std::numbers::pi * static_cast<double>(k) / static_cast<double>(scans);
        temperature_C.push_back(21.337 + 0.12 * std::sin(turn + phase) +
                                0.03 * std::sin(3.3 * turn + 2.0 * phase));
    }
    return temperature_C;
}

std::vector<double> read_by(const std::vector<double>& temperature_C, double noise_C, unsigned seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> noise;
    std::vector<double> readings;
    readings.reserve(temperature_C.size());
    for (const double value : temperature_C)
        readings.push_back(step_C * std::round((value + noise_C * noise(random)) / step_C));
    return readings;
}

/// What a steady state is said for: means of a quarter of an hour. Their errors, rms.
double error_C(const std::vector<double>& values, const std::vector<double>& truth) {
    double squares = 0.0;
    double error = 0.0;
    for (std::size_t k = 0; k < values.size(); ++k) {
        error += (values[k] - truth[k]) / quarter_hour;
        if (k >= quarter_hour) error -= (values[k - quarter_hour] - truth[k - quarter_hour]) / quarter_hour;
        if (k + 1 >= quarter_hour) squares += error * error;
    }
    return std::sqrt(squares / static_cast<double>(values.size() - quarter_hour + 1));
}

TEST(UnroundedRoom, IsNearerToTheRoomThanItsReadings) {
    struct Case {
        double noise_C;
        double share;  ///< of the readings' error that may be left
    };
    // Without noise only the moments are known at which one reading gives way to the next.
    for (const auto& [noise_C, share] : {Case{0.0, 0.85}, Case{0.01, 0.5}, Case{0.02, 0.5}}) {
        double of_readings = 0.0;
        double of_curve = 0.0;
        for (unsigned seed = 1; seed <= 8; ++seed) {
            const std::vector<double> room = hall(0.7 * seed);
            const std::vector<double> readings = read_by(room, noise_C, seed);
            const auto curve = unrounded_room(readings, period_s);
            ASSERT_TRUE(curve.has_value()) << noise_C;
            of_readings += error_C(readings, room);
            of_curve += error_C(*curve, room);
        }
        EXPECT_LT(of_curve, share * of_readings) << "noise " << noise_C << " C";
    }
}

TEST(UnroundedRoom, LeavesNoisyAndFineAndConstantReadingsAlone) {
    EXPECT_FALSE(unrounded_room(read_by(hall(1.0), 0.05, 1), period_s).has_value());
    EXPECT_FALSE(unrounded_room(read_by(hall(1.0), 0.2, 1), period_s).has_value());
    EXPECT_FALSE(unrounded_room(std::vector<double>(scans, 21.3), period_s).has_value());
    EXPECT_FALSE(unrounded_room({21.3, 21.4}, period_s).has_value());
    EXPECT_FALSE(unrounded_room({}, period_s).has_value());
}

TEST(UnroundedRoom, StaysWithItsReadingsThroughADoorAndAGap) {
    constexpr std::size_t door = 700;
    std::vector<double> room = hall(2.0);
    for (std::size_t k = door; k < scans; ++k) {
        room[k] -= 2.0 * (1.0 - std::exp(-static_cast<double>(k - door) / 8.0));
    }
    std::vector<double> readings = read_by(room, 0.01, 3);
    for (std::size_t k = 300; k < 420; ++k) readings[k] = no_value;
    const auto curve = unrounded_room(readings, period_s);
    ASSERT_TRUE(curve.has_value());
    for (std::size_t k = 0; k < scans; ++k) {
        if (std::isnan(readings[k])) {
            EXPECT_TRUE(std::isnan((*curve)[k]));
        } else if (k >= door && k < door + 20) {
            EXPECT_EQ((*curve)[k], readings[k]) << "scan " << k;
        } else {
            EXPECT_LE(std::abs((*curve)[k] - readings[k]), step_C) << "scan " << k;
        }
    }
    const auto afterwards = [](const std::vector<double>& values) {
        return std::vector<double>(values.begin() + door + 20, values.end());
    };
    EXPECT_LT(error_C(afterwards(*curve), afterwards(room)),
              0.8 * error_C(afterwards(readings), afterwards(room)));
}

TEST(UnroundedRoom, AThermostatIsLeftAsItIsRead) {
    std::vector<double> room;
    for (std::size_t k = 0; k < scans; ++k) {
        const double turn = 2.0 * std::numbers::pi * static_cast<double>(k) / 48.0;
        room.push_back(21.0 + 0.5 * std::sin(turn));
    }
    const std::vector<double> readings = read_by(room, 0.01, 5);
    const std::vector<double> taken = unrounded_room(readings, period_s).value_or(readings);
    EXPECT_EQ(taken, readings);
}

}  // namespace
}  // namespace thermbal
