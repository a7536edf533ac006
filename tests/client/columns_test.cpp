#include "columns.hpp"

#include <gtest/gtest.h>

#include "scenes.hpp"

namespace thermbal::test {
namespace {

class Columns : public ::testing::Test {
  protected:
    void SetUp() override { use_utf8(); }
};

TEST_F(Columns, WideAndCombiningCharactersCountAsATerminalDrawsThem) {
    EXPECT_EQ(display_width("T5"), 2U);
    EXPECT_EQ(display_width("Späne"), 5U);
    EXPECT_EQ(display_width("主轴"), 4U);
    EXPECT_EQ(display_width("e\u0301"), 1U);
    EXPECT_EQ(display_width("▁█"), 2U);
}

TEST_F(Columns, ClippingNeverCutsACharacterInTwo) {
    EXPECT_EQ(clipped("主轴前轴承", 10), "主轴前轴承");
    EXPECT_EQ(clipped("主轴前轴承", 9), "主轴前轴~");
    EXPECT_EQ(clipped("主轴前轴承", 8), "主轴前~");
    EXPECT_EQ(clipped("abc", 0), "");
    EXPECT_EQ(display_width(left_aligned("主轴前轴承", 8)), 8U);
    EXPECT_EQ(right_aligned("5", 3), "  5");
}

TEST_F(Columns, NothingThatSteersATerminalIsPrinted) {
    EXPECT_EQ(printable("a\x1b[2Jb\nc\x7f\xc2\x9b"), "a?[2Jb c??");
    EXPECT_EQ(printable("\xff ok \xe4"), "? ok ?");
    std::setlocale(LC_CTYPE, "C");
    EXPECT_EQ(printable("Späne"), "Sp??ne");
}

TEST_F(Columns, ATableIsAsWideAsItsWidestCells) {
    TextTable table({{"name"}, {"C", true}});
    table.add({"主轴", "1.5"});
    table.add({"T5", "-10.25"});
    EXPECT_EQ(table.str(),
              "name       C\n"
              "主轴     1.5\n"
              "T5    -10.25\n");
}

}  // namespace
}  // namespace thermbal::test
