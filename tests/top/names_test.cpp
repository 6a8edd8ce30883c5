// Names that are longer than their column.
#include "top/names.hpp"

#include <gtest/gtest.h>

#include <clocale>
#include <set>

namespace arbiter::top {
namespace {

class TopNames : public testing::Test {
 protected:
  void SetUp() override { ASSERT_NE(std::setlocale(LC_CTYPE, "C.UTF-8"), nullptr); }

  // How many look alike at that width.
  static std::size_t alike(const std::vector<std::string>& names, std::size_t columns) {
    ShortNames cutter(Charset::kUtf8);
    cutter.set(names);
    std::set<std::string> seen;
    for (const std::string& each : names) seen.insert(cutter.cut(each, columns));
    return names.size() - seen.size();
  }
};

TEST_F(TopNames, ThatFitStayAsTheyAre) {
  ShortNames names(Charset::kUtf8);
  names.set({"/Arm/pos:i"});
  EXPECT_EQ(names.cut("/Arm/pos:i", 10), "/Arm/pos:i");
  EXPECT_EQ(names.cut("/Arm\x1b", 10), "/Arm\\x1b");
}

TEST_F(TopNames, LoseTheEndsOfTheirFirstParts) {
  const std::string name = "/Navigation/local_planner/cmd_vel:o";
  EXPECT_EQ(cut_parts(name, 34, Charset::kUtf8), "/Navigation/local_plann…/cmd_vel:o");
  EXPECT_EQ(cut_parts(name, 20, Charset::kUtf8), "/Nav…/loc…/cmd_vel:o");
  EXPECT_EQ(cut_parts(name, 20, Charset::kAscii), "/Nav~/loc~/cmd_vel:o");
  EXPECT_EQ(cut_parts(name, 16, Charset::kUtf8), "/N…/l…/cmd_vel:o");
  EXPECT_EQ(cut_parts(name, 15, Charset::kUtf8), "/Navi…cmd_vel:o");
  EXPECT_EQ(cut_parts("/a/local_planner/cmd_vel:o", 20, Charset::kUtf8), "/a/local_…/cmd_vel:o");
}

TEST_F(TopNames, AreCutInTheMiddleAndAroundAPlace) {
  EXPECT_EQ(cut_middle("/abcdefghij", 7, 4, Charset::kUtf8), "/ab…hij");
  EXPECT_EQ(cut_middle("/腕腕腕腕腕腕", 7, 4, Charset::kUtf8), "/腕…腕");  // half of one cannot be
  EXPECT_EQ(cut_around("/cam_left_image:o", 5, 14, Charset::kUtf8), "/…left_image:o");
  EXPECT_EQ(cut_around("/cam_left_image:o", 5, 8, Charset::kUtf8), "…left_i…");
  EXPECT_EQ(cut_around("/cam_left_image:o", 0, 8, Charset::kUtf8), "/cam_le…");
}

TEST_F(TopNames, CanBeToldApartWhereverTheyDiffer) {
  EXPECT_EQ(alike({"/Navigation/local_planner/path:o", "/Navigation/global_planner/path:o",
                   "/Navigation/local_planner/cmd_vel:o"},
                  20),
            0u);
  // At the end of a part that is not the last one.
  EXPECT_EQ(alike({"/Perception/camera_left/image:o", "/Perception/camera_right/image:o"}, 20), 0u);
  // In the middle of the last one.
  EXPECT_EQ(alike({"/camera_front_left_stereo_rectified_image:o",
                   "/camera_front_right_stereo_rectified_image:o"},
                  20),
            0u);
  // Short ones count: nothing may look like one of them.
  EXPECT_EQ(alike({"/N…/l…/p:o", "/Nav/local/p:o"}, 10), 0u);
  std::vector<std::string> numbered;
  numbered.reserve(100);
  for (int i = 0; i < 100; ++i) {
    numbered.push_back("/Perception/segmentation/object_" + std::to_string(i) + "/pose:o");
  }
  EXPECT_EQ(alike(numbered, 20), 0u);
}

// A part in the middle, of many: what all have is dropped, what differs stays.
TEST_F(TopNames, LoseWhatAllHaveBeforeWhatDiffers) {
  ShortNames names(Charset::kUtf8);
  std::vector<std::string> all;
  for (int i = 0; i < 300; ++i) {
    const std::string robot = "/very/long/namespace/robot_" + std::to_string(i);
    all.push_back(robot + "/navigation_stack/controller/cmd_vel:o");
    all.push_back(robot + "/base/cmd_vel:i");
  }
  names.set(all);
  EXPECT_EQ(names.cut(all[40], 28), "…/robot_20/…/cmd_vel:o");
  EXPECT_EQ(names.cut(all[40], 20), "…20/…/cmd_vel:o");
  ShortNames ascii(Charset::kAscii);
  ascii.set(all);
  EXPECT_EQ(ascii.cut(all[40], 20), "~20/~/cmd_vel:o");
  for (std::size_t columns = 16; columns <= 64; ++columns) {
    EXPECT_EQ(alike(all, columns), 0u) << columns;
  }
}

TEST_F(TopNames, AreNeverWiderThanTheyMay) {
  const std::vector<std::string> names = {"/Navigation/local_planner/path:o", "/腕腕腕/腕腕腕腕腕",
                                          "no slash in a name of a terminal", "////////////",
                                          "/\xff\xff\xff\xff/\x1b[2J"};
  for (const Charset charset : {Charset::kUtf8, Charset::kAscii}) {
    ShortNames cutter(charset);
    cutter.set(names);
    for (std::size_t columns = 0; columns < 40; ++columns) {
      for (const std::string& each : names) {
        EXPECT_LE(columns_of(cutter.cut(each, columns)), columns) << each;
        for (std::size_t place = 0; place <= each.size() + 1; ++place) {
          const std::string text = safe(each, charset);
          EXPECT_LE(columns_of(cut_around(text, place, columns, charset)), columns) << each;
        }
      }
      EXPECT_LE(columns_of(cutter.cut("/nobody/has/said/that/it/is/there", columns)), columns);
    }
  }
}

}  // namespace
}  // namespace arbiter::top
