#pragma once

#include <clocale>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "watch_frame.hpp"

namespace thermbal::test {

/// Names in other scripts and block characters count in columns only under such a locale.
inline void use_utf8() {
    ASSERT_NE(std::setlocale(LC_CTYPE, "C.UTF-8"), nullptr);
}

/// Sixteen channels: T1 the ambient, T2 ... T8 declared, T9 open, T10 without an answer, T11 barely warming,
/// the rest measuring; figures of every length.
inline WatchScene busy_scene() {
    using nlohmann::json;
    WatchScene scene;
    scene.status = {{"state", "running"},
                    {"machine", "VMC-3"},
                    {"period_s", 15.0},
                    {"test",
                     {{"id", 12},
                      {"name", "idle 5000 r/min"},
                      {"time_min", 62.25},
                      {"scans", 250},
                      {"reason", "waiting for T9, T10, T12, T13, T14, T15, T16"}}}};
    json list = json::array();
    for (int i = 1; i <= 16; ++i) {
        json recent = json::array();
        for (int k = 0; k < 24; ++k) recent.push_back(k == 5 ? json(nullptr) : json(18.0 + 0.1 * i * k));
        json channel = {{"channel", "T" + std::to_string(i)},
                        {"place", i == 4 ? "主轴前轴承 front bearing" : "front bearing"},
                        {"role", i == 1 ? "ambient" : "structure"},
                        {"required", i != 1},
                        {"value_C", i == 16 ? -123.456 : 20.0 + i},
                        {"quality", i == 9    ? "open"
                                    : i == 10 ? "communication"
                                              : "good"},
                        {"rise_C", i == 16 ? 1234.5 : 2.0 + i},
                        {"rate_C_per_h", i == 12 ? json(nullptr) : json(-0.01)},
                        {"recent_C", recent}};
        if (i > 1) {
            channel["state"] = i <= 8    ? "declared"
                               : i == 9  ? "dead"
                               : i == 11 ? "barely_warming"
                                         : "measuring";
            channel["n"] = i == 12 ? 0 : 20;
            channel["window_rmse_C"] = 0.02 * i;
            channel["steady_state_C"] = 26.74;
            channel["steady_state_low_C"] = i == 16 ? -1126.61 : 26.61;
            channel["steady_state_high_C"] = i == 16 ? 1126.88 : 26.88;
            channel["equilibrium_time_min"] = 130.5;
            channel["time_left_min"] = i == 15 ? 123456.0 : 68.2;
            channel["reason"] = "interval: 0.31 C wide, 0.20 C is asked for";
        }
        list.push_back(std::move(channel));
    }
    scene.channels = {{"time_min", 62.25}, {"channels", list}};
    for (int i = 0; i < 60; ++i) {
        scene.events.push_back(
            {{"id", i + 1},
             {"time_s", 60.0 * i},
             {"kind", "annotation"},
             {"channel", "T5"},
             {"message", "remark " + std::to_string(i) + ", and a long one: " + std::string(90, 'x')}});
    }
    json curve = json::array();
    for (int n = 1; n <= 35; ++n)
        curve.push_back(n == 34 ? json(nullptr) : json(0.05 + 0.002 * (n - 20) * (n - 20)));
    scene.curve = {{"channel", "T5"}, {"n", 20}, {"window_end_min", 62.0}, {"rmse_by_n_C", curve}};
    scene.scan_age_s = 3.0;
    return scene;
}

}  // namespace thermbal::test
