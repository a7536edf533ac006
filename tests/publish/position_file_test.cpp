#include "publish/position_file.hpp"

#include <fstream>

#include <gmock/gmock.h>
#include <stdlib.h>
#include <sys/stat.h>

#include "publish/secrets.hpp"

namespace thermbal {
namespace {

class PositionFileTest : public ::testing::Test {
  protected:
    PositionFileTest() {
        std::string name = (std::filesystem::temp_directory_path() / "thermbal-position-XXXXXX").string();
        folder = mkdtemp(name.data());
    }
    ~PositionFileTest() override { std::filesystem::remove_all(folder); }
    void write(const std::string& text) const { std::ofstream(folder / "file") << text; }

    std::filesystem::path folder;
    FeedPosition position{"a1b2", 3, 1600, 4, 17, 99};
};

TEST_F(PositionFileTest, ComesBackAsItWas) {
    const auto path = folder / "position.json";
    EXPECT_FALSE(load_position(path));
    ASSERT_TRUE(save_position(path, position));
    EXPECT_EQ(load_position(path), position);
    position.scan = 1601;
    ASSERT_TRUE(save_position(path, position));
    EXPECT_EQ(load_position(path), position);
    struct stat file{};
    ASSERT_EQ(stat(path.c_str(), &file), 0);
    EXPECT_EQ(file.st_mode & 0077U, 0U);
}

TEST_F(PositionFileTest, WhatIsNoPositionIsNone) {
    const std::string good = position_text(position);
    for (const std::string& text :
         {std::string(), std::string("{}"), std::string("[1,2]"), std::string("null"),
          good.substr(0, good.size() / 2), std::string("\xff\xfe\0x", 4)}) {
        write(text);
        EXPECT_FALSE(load_position(folder / "file")) << text;
    }
    EXPECT_FALSE(
        position_in(R"({"database":"a","test":1.5,"scan":0,"revision":0,"declaration":0,"event":0})"));
    EXPECT_FALSE(position_in(R"({"database":7,"test":1,"scan":0,"revision":0,"declaration":0,"event":0})"));
}

TEST_F(PositionFileTest, AFolderThatIsNotThereIsSaid) {
    const auto saved = save_position(folder / "nowhere" / "position.json", position);
    ASSERT_FALSE(saved);
    EXPECT_EQ(saved.error().next, NextStep::retry);
    EXPECT_THAT(saved.error().message, ::testing::HasSubstr("No such file"));
}

TEST_F(PositionFileTest, ASecretIsOneLineOfAFileOrACredential) {
    write("s3cret\r\n");
    EXPECT_EQ(read_secret((folder / "file").string(), ""), "s3cret");
    EXPECT_EQ(read_secret("credential:file", folder.string()), "s3cret");
    const auto none = read_secret("credential:file", "");
    ASSERT_FALSE(none);
    EXPECT_THAT(none.error().message, ::testing::HasSubstr("LoadCredential=file:"));
    write("\n");
    EXPECT_FALSE(read_secret((folder / "file").string(), ""));
}

}  // namespace
}  // namespace thermbal
