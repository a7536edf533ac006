#include "simulator/station.hpp"

#include <gmock/gmock.h>

namespace thermbal {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

const Bytes read_all = {4, 0, 0, 0, 8};

struct Rig {
    std::vector<AnsweredRead> reads;
    std::vector<ModuleWrite> writes;
    std::vector<std::pair<double, bool>> spindle;
    Station station;

    Rig(std::vector<Fault> faults, SimClock clock, ForeignUnit foreign = ForeignUnit::exception_11)
        : station(ModbusModule(*find_register_map("int16"), {{.id = 1, .first_channel = 0, .channels = 8},
                                                             {.id = 2, .first_channel = 8, .channels = 8}}),
                  {.read_C = [](double time_s) { return std::vector<double>(16, time_s / 10.0); },
                   .run_spindle = [this](double time_s, bool run) { spindle.emplace_back(time_s, run); }},
                  FaultPlan(std::move(faults)), clock, foreign,
                  {.on_read = [this](const AnsweredRead& read) { reads.push_back(read); },
                   .on_write = [this](double, std::uint8_t,
                                      const ModuleWrite& write) { writes.push_back(write); }}) {}

    std::vector<Delivery> ask(std::uint8_t unit, const Bytes& pdu, std::int64_t now_ns = 0,
                              Framing framing = Framing::tcp) {
        return station.serve(framing, {.transaction = 9, .unit = unit, .pdu = pdu}, now_ns);
    }
};

TEST(Station, InLockstepOnlyTheFirstUnitMovesTime) {
    Rig rig({}, SimClock::lockstep(15.0));
    for (int scan = 0; scan < 3; ++scan) {
        rig.ask(1, read_all);
        rig.ask(2, read_all);
        rig.ask(1, {4, 0, 1, 0, 2});
    }
    std::vector<double> times;
    for (const AnsweredRead& read : rig.reads) times.push_back(read.time_s);
    EXPECT_THAT(times, ElementsAre(0, 0, 0, 15, 15, 15, 30, 30, 30));
    EXPECT_THAT(rig.reads.back().words, ElementsAre(30, 30));  // 30 s: 3.0 C
}

TEST(Station, AFaultDoesNotStopLockstepTime) {
    Rig rig({*parse_fault("silence@15-45")}, SimClock::lockstep(15.0));
    EXPECT_THAT(rig.ask(1, read_all), SizeIs(1));
    EXPECT_THAT(rig.ask(1, read_all), IsEmpty());
    EXPECT_THAT(rig.ask(1, read_all), IsEmpty());
    EXPECT_THAT(rig.ask(1, read_all), SizeIs(1));
    EXPECT_EQ(rig.reads[1].fault, "silence");
    EXPECT_EQ(rig.reads[3].fault, "");
}

TEST(Station, ScaledTimeIsTheMonotonicClockTimesAFactor) {
    Rig rig({}, SimClock::scaled(200.0, 1'000'000'000));
    rig.ask(1, read_all, 500'000'000);
    rig.ask(1, read_all, 1'500'000'000);
    rig.ask(2, read_all, 4'000'000'000);
    EXPECT_EQ(rig.reads[0].time_s, 0.0);
    EXPECT_NEAR(rig.reads[1].time_s, 100.0, 1e-9);
    EXPECT_NEAR(rig.reads[2].time_s, 600.0, 1e-9);
}

TEST(Station, ForeignUnits) {
    Rig rig({}, SimClock::lockstep(15.0));
    EXPECT_EQ(rig.ask(3, read_all)[0].bytes, tcp_frame(9, 3, Bytes{0x84, 11}));
    EXPECT_THAT(rig.ask(3, read_all, 0, Framing::rtu), IsEmpty());
    Rig quiet({}, SimClock::lockstep(15.0), ForeignUnit::silence);
    EXPECT_THAT(quiet.ask(3, read_all), IsEmpty());
}

TEST(Station, OnlyTheFirstUnitsCoilZeroIsTheSpindle) {
    Rig rig({}, SimClock::lockstep(15.0));
    rig.ask(1, read_all);
    rig.ask(1, read_all);
    rig.ask(2, {5, 0, 0, 0, 0});
    rig.ask(1, {5, 0, 1, 0, 0});
    rig.ask(1, {6, 3, 0xE8, 0, 0});
    EXPECT_THAT(rig.spindle, IsEmpty());
    rig.ask(1, {15, 0, 0, 0, 2, 1, 0});
    EXPECT_THAT(rig.spindle, ElementsAre(std::pair(15.0, false)));
    EXPECT_THAT(rig.writes, SizeIs(4));
}

TEST(Station, ASensorFaultShowsInItsUnitOnly) {
    Rig rig({*parse_fault("open:T10@0")}, SimClock::lockstep(15.0));
    rig.ask(1, read_all);
    rig.ask(2, read_all);
    EXPECT_THAT(rig.reads[0].words, ElementsAre(0, 0, 0, 0, 0, 0, 0, 0));
    EXPECT_THAT(rig.reads[1].words, ElementsAre(0, 0x7FFF, 0, 0, 0, 0, 0, 0));
}

TEST(Station, AFrozenUnitRepeatsItsLastReadUntilItThaws) {
    Rig rig({*parse_fault("frozen:2@30-60")}, SimClock::lockstep(15.0));
    for (int scan = 0; scan < 6; ++scan) {
        rig.ask(1, {4, 0, 0, 0, 1});
        rig.ask(2, {4, 0, 0, 0, 1});
    }
    std::vector<int> first;
    std::vector<int> second;
    std::vector<std::string> said;
    for (std::size_t i = 0; i < rig.reads.size(); i += 2) {
        first.push_back(rig.reads[i].words[0]);
        second.push_back(rig.reads[i + 1].words[0]);
        said.push_back(rig.reads[i + 1].fault);
    }
    EXPECT_THAT(first, ElementsAre(0, 15, 30, 45, 60, 75));
    EXPECT_THAT(second, ElementsAre(0, 15, 15, 15, 60, 75));
    EXPECT_THAT(said, ElementsAre("", "", "frozen", "frozen", "", ""));
}

TEST(Station, EveryCodeCanBeServed) {
    Rig rig({*parse_fault("code=-30000:T1@0"), *parse_fault("code=0x7FFE:T2@0")}, SimClock::lockstep(15.0));
    rig.ask(1, read_all);
    EXPECT_EQ(rig.reads[0].words[0], 0x8AD0);
    EXPECT_EQ(rig.reads[0].words[1], 0x7FFE);
}

}  // namespace
}  // namespace thermbal
