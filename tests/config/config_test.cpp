#include <algorithm>
#include <filesystem>
#include <fstream>
#include <random>

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "config/load.hpp"

namespace thermbal {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

const std::string source_dir = THERMBAL_SOURCE_DIR;

ProfileLookup shipped_profiles() {
    return profiles_in({source_dir + "/config/profiles"});
}

std::string text_of(const fs::path& path) {
    const auto text = read_text_file(path.string());
    EXPECT_TRUE(text) << text.error().message;
    return text.value_or("");
}

std::vector<fs::path> files_in(const std::string& folder) {
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(source_dir + folder)) files.push_back(entry.path());
    std::ranges::sort(files);
    return files;
}

std::string expected_message(const std::string& text) {
    return text.substr(2, text.find('\n') - 2);
}

/// A configuration with one TCP line, one unit of 16 and two channels, and what a test adds to it.
Config load(const std::string& head, const std::string& unit = "", const std::string& tail = "") {
    const std::string text = head + "[[line]]\ntransport = \"tcp\"\nhost = \"::1\"\n[[unit]]\n" + unit +
                             "profile = \"generic-16x-int16\"\n[[channel]]\nname = \"T1\"\ninput = 1\nrole = "
                             "\"ambient\"\n[[channel]]\nname = \"T2\"\ninput = 2\n" +
                             tail;
    auto config = load_config(text, "inline.toml", shipped_profiles());
    EXPECT_TRUE(config) << config.error().message;
    return config.value_or(Config{});
}

TEST(Lines, APauseAfterAFailedOpeningIsOverBeforeTheNextScan) {
    EXPECT_EQ(load("").lines[0].link.longest_pause_s, 2.0);
    EXPECT_EQ(load("[test]\nperiod_s = 2.0\n").lines[0].link.longest_pause_s, 0.5);
    const LinkOptions fast = load(
                                 "[test]\nperiod_s = 0.2\n[identification]\nevery_s = 10.0\n"
                                 "[[line]]\nname = \"fast\"\ntransport = \"tcp\"\nhost = \"h\"\n"
                                 "response_timeout_ms = 20\nconnect_timeout_ms = 20\n",
                                 "line = \"fast\"\n")
                                 .lines[0]
                                 .link;
    EXPECT_EQ(fast.longest_pause_s, 0.05);
    EXPECT_EQ(fast.first_pause_s, 0.05);
    const Config config = load(
        "[[line]]\nname = \"own\"\ntransport = \"tcp\"\nhost = \"h\"\n"
        "response_timeout_ms = 1001\nreconnect_pause_ms = 30\n",
        "line = \"own\"\n");
    EXPECT_EQ(config.lines[0].link.longest_pause_s, 0.03);
    EXPECT_THAT(explain_config(config), HasSubstr("response_timeout_ms = 1001\n"));
    EXPECT_THAT(explain_config(config), HasSubstr("reconnect_pause_ms = 30\n"));
}

TEST(DefaultConfiguration, LoadsAndIsWhatTheHeaderSays) {
    const auto config = load_config_file(source_dir + "/config/thermbald.toml", shipped_profiles());
    ASSERT_TRUE(config) << config.error().message;
    EXPECT_EQ(config->channels.size(), 16U);
    EXPECT_EQ(config->ambient(), 0U);
    EXPECT_EQ(std::ranges::count(config->channels, true, &ChannelConfig::required), 15);
    EXPECT_EQ(config->test.period_s, TestConfig{}.period_s);
    EXPECT_EQ(config->store.path, StoreConfig{}.path);
    EXPECT_EQ(config->service.socket, ServiceConfig{}.socket);
    EXPECT_EQ(config->identification.max_lag, IdentificationConfig{}.max_lag);
    EXPECT_EQ(config->stop.action, StopConfig::Action::none);
}

TEST(DefaultConfiguration, WhatIsCommentedOutIsAcceptedToo) {
    std::string text = text_of(source_dir + "/config/thermbald.toml");
    const auto uncomment = [&](const std::string& key, const std::string& with) {
        const std::size_t at = text.find("# " + key);
        ASSERT_NE(at, std::string::npos) << key;
        text.replace(at, 2 + key.size(), with);
    };
    uncomment("max_duration_min", "max_duration_min");
    uncomment("model", "model");
    uncomment("inputs", "inputs");
    uncomment("operators_group", "operators_group");
    uncomment("response_timeout_ms", "response_timeout_ms");
    uncomment("connect_timeout_ms", "connect_timeout_ms");
    uncomment("required", "required");
    uncomment("offset_C", "offset_C");
    const auto config = load_config(text, "default", shipped_profiles());
    EXPECT_TRUE(config) << config.error().message;
}

TEST(RefusedConfigurations, EveryMistakeHasItsPlaceAndItsWord) {
    const auto files = files_in("/tests/config/refused");
    ASSERT_GE(files.size(), 25U);
    for (const fs::path& file : files) {
        const std::string text = text_of(file);
        const auto config = load_config(text, file.filename().string(), shipped_profiles());
        ASSERT_FALSE(config) << file;
        EXPECT_EQ(config.error().next, NextStep::refuse_input);
        EXPECT_THAT(config.error().message, HasSubstr(expected_message(text))) << file;
    }
}

TEST(RefusedProfiles, EveryMistakeHasItsPlaceAndItsWord) {
    for (const fs::path& file : files_in("/tests/config/refused_profiles")) {
        const std::string text = text_of(file);
        const auto profile = load_profile(text, file.filename().string());
        ASSERT_FALSE(profile) << file;
        EXPECT_THAT(profile.error().message, HasSubstr(expected_message(text))) << file;
    }
}

TEST(Configuration, TellsAllMistakesInTheOrderOfTheFile) {
    const auto config =
        load_config("[test]\nperiod_s = -1\n[log]\nlevel = \"loud\"\n", "two.toml", shipped_profiles());
    ASSERT_FALSE(config);
    const std::string& message = config.error().message;
    EXPECT_THAT(message, HasSubstr("two.toml:2:12: test.period_s"));
    EXPECT_LT(message.find("test.period_s"), message.find("log.level"));
}

TEST(Configuration, DefaultsOfAShortOne) {
    const Config config = load("");
    EXPECT_EQ(config.lines[0].link.name, "line 1");
    EXPECT_EQ(config.lines[0].link.port, 502);
    EXPECT_EQ(config.units[0].unit_id, 1);
    EXPECT_FALSE(config.channels[0].required);
    EXPECT_TRUE(config.channels[1].required);
    EXPECT_FALSE(config.test.max_duration_min.has_value());
}

TEST(Configuration, SerialLineByUsb) {
    const auto config = load_config(
        "[[line]]\ntransport = \"rtu\"\nusb = { vid_pid = \"1a86:7523\", serial = \"A5\" }\nbaud = "
        "19200\nparity = "
        "\"even\"\nresponse_timeout_ms = 250\n[[unit]]\nprofile = \"mb8art\"\n[[channel]]\nname = "
        "\"T1\"\ninput = 8\n",
        "usb.toml", shipped_profiles());
    ASSERT_TRUE(config) << config.error().message;
    const LineConfig& line = config->lines[0];
    ASSERT_TRUE(line.usb);
    EXPECT_EQ(line.usb->usb_pid, 0x7523);
    EXPECT_EQ(line.usb->serial, "A5");
    EXPECT_EQ(line.link.baud, 19200);
    EXPECT_EQ(line.link.parity, 'E');
    EXPECT_DOUBLE_EQ(line.link.response_timeout_s, 0.25);
}

TEST(Configuration, ExplainedOneMeansTheSame) {
    for (const std::string& stop :
         {std::string(),
          std::string("[stop]\naction = \"command\"\ncommand = [\"/bin/true\", \"a \\\"b\\\"\\n\"]\n"),
          std::string(
              "[stop]\naction = \"write_register\"\naddress = 4\nvalue = 65535\ntimeout_s = 2.5\n")}) {
        const Config config = load(
            "[test]\nname = \"idle \\\"5000\\\"\"\nperiod_s = 7.5\nmax_duration_min = 90\nstart = \"auto\"\n"
            "model = \"/models/a b.toml\"\ninputs = { spindle_rpm = 5000, spindle_load_pct = 12.5 }\n",
            "", stop);
        const std::string explained = explain_config(config);
        const auto again = load_config(explained, "explained", shipped_profiles());
        ASSERT_TRUE(again) << again.error().message << explained;
        EXPECT_EQ(explain_config(*again), explained);
        EXPECT_EQ(again->test.name, config.test.name);
        EXPECT_EQ(again->test.max_duration_min, 90.0);
        EXPECT_EQ(again->test.model, "/models/a b.toml");
        ASSERT_EQ(again->test.inputs.size(), 2U);
        EXPECT_EQ(again->test.inputs[0].name, "spindle_load_pct");
        EXPECT_EQ(again->test.inputs[0].value, 12.5);
        EXPECT_EQ(again->stop.command, config.stop.command);
        EXPECT_EQ(again->stop.value, config.stop.value);
    }
}

TEST(Configuration, MinusZeroIsZeroWhenItIsWrittenOut) {
    const Config config = load("[test]\ninputs = { spindle_rpm = -0.0 }\n", "", "offset_C = -0.0\n");
    const std::string explained = explain_config(config);
    const auto again = load_config(explained, "explained", shipped_profiles());
    ASSERT_TRUE(again) << again.error().message << explained;
    EXPECT_EQ(explain_config(*again), explained);
}

TEST(Profiles, EveryShippedOneLoadsAndNamesItsSource) {
    const auto files = files_in("/config/profiles");
    ASSERT_GE(files.size(), 8U);
    for (const fs::path& file : files) {
        const auto profile = shipped_profiles()(file.stem().string());
        ASSERT_TRUE(profile) << profile.error().message;
        EXPECT_EQ(profile->name, file.stem().string());
        EXPECT_GT(profile->source.size(), 20U);
        const auto again = load_profile(explain_profile(*profile), "explained");
        ASSERT_TRUE(again) << again.error().message;
        EXPECT_EQ(explain_profile(*again), explain_profile(*profile));
        // Every module reads a machine hall, and its faults are never good.
        EXPECT_EQ(decode(*profile, encode(*profile, 25.0)).quality, Quality::good) << file;
        EXPECT_NEAR(decode(*profile, encode(*profile, -5.3)).value_C, -5.3, 1e-6) << file;
    }
}

Quality quality_of(const std::string& profile_name, int word) {
    const auto profile = shipped_profiles()(profile_name);
    return decode(profile.value(), std::vector{static_cast<std::uint16_t>(word)}).quality;
}

TEST(Profiles, FaultCodesOfTheDataSheets) {
    EXPECT_EQ(quality_of("generic-16x-int16", 0x7FFF), Quality::open);
    EXPECT_EQ(quality_of("generic-16x-int16", 0x8000), Quality::shorted);
    EXPECT_EQ(quality_of("mb8art", 30000), Quality::open);
    EXPECT_EQ(quality_of("mb8art", -30000), Quality::shorted);
    EXPECT_EQ(quality_of("comwintop-8pt1000", 6500), Quality::open);
    EXPECT_EQ(quality_of("comwintop-8pt1000", 0x7FFF), Quality::open);
    EXPECT_EQ(quality_of("comwintop-8pt1000", -1800), Quality::shorted);
    EXPECT_EQ(quality_of("comwintop-8pt1000", 0x8000), Quality::shorted);
    EXPECT_EQ(quality_of("comwintop-8pt1000", -1385), Quality::good);
    EXPECT_EQ(quality_of("wb-mai11", 0x7FFF), Quality::open);
    EXPECT_EQ(quality_of("atal-awp-c", -32005), Quality::open);
    EXPECT_EQ(quality_of("wago-750-464", 0x2134), Quality::over_range);
    EXPECT_EQ(quality_of("wago-750-464", 0xF830), Quality::under_range);
    EXPECT_EQ(quality_of("pta8c04", 6501), Quality::over_range);
}

TEST(Profiles, AUserFolderComesFirstAndAPathIsTaken) {
    const fs::path folder = fs::path(::testing::TempDir()) / "thermbal_profiles";
    fs::create_directories(folder);
    const std::string path = (folder / "mb8art.toml").string();
    std::ofstream(path) << "source = \"my own\"\ninputs = 2\n";
    EXPECT_EQ(profiles_in({folder.string(), source_dir + "/config/profiles"})("mb8art")->inputs, 2);
    EXPECT_EQ(profiles_in({})(path)->source, "my own");
    EXPECT_THAT(profiles_in({folder.string()})("nothing").error().message, HasSubstr("mb8art"));
}

TEST(Configuration, DamagedTextNeverCrashes) {
    const std::string whole = text_of(source_dir + "/config/thermbald.toml");
    std::mt19937 random(7);
    std::uniform_int_distribution<std::size_t> at(0, whole.size() - 1);
    std::uniform_int_distribution<int> byte(0, 255);
    for (int round = 0; round < 2000; ++round) {
        std::string text = whole;
        for (int i = 0; i < 1 + round % 4; ++i) text[at(random)] = static_cast<char>(byte(random));
        if (round % 5 == 0) text.resize(at(random));
        const auto config = load_config(text, "damaged", shipped_profiles());
        if (config) continue;
        EXPECT_EQ(config.error().next, NextStep::refuse_input);
        EXPECT_THAT(config.error().message, HasSubstr("damaged:"));
    }
}

TEST(Files, MissingFolderAndLarge) {
    EXPECT_THAT(read_text_file("/no/such/file.toml").error().message,
                HasSubstr("/no/such/file.toml: No such file"));
    EXPECT_THAT(read_text_file("/tmp").error().message, HasSubstr("is a folder"));
    EXPECT_THAT(read_text_file("/dev/zero").error().message, HasSubstr("larger than 4 MiB"));
}

}  // namespace
}  // namespace thermbal
